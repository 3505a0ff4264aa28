"""The calibration interface: maps the intensities of one physical unit to slopes or depth."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal

from tactile_core.interfaces.artefact import Artefact
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference

Compensation = Literal["channel", "none"]


class Calibration(Artefact):
    """An immutable light model, fitted to one physical unit at one image size.

    Attributes
    ----------
    compensation : {"channel", "none"}
        "channel": illumination drift is compensated in each channel before the model sees a
        frame. "none": the model handles drift itself.
    """

    compensation: ClassVar[Compensation] = "channel"

    @abstractmethod
    def measure(self, frame: Frame, reference: Reference) -> Gradients | HeightMap:
        """Convert one frame to slopes; some models return height directly.

        Raises
        ------
        CalibrationError
            The frame differs in size, number of channels or bit depth from those that the model
            was fitted on.
        """
