"""The calibration interface: from the intensities of one physical unit to slopes, or to depth."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal, Self

from tactile_core.interfaces.artefact import Artefact
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference

Compensation = Literal["channel", "none"]


class Calibration(Artefact):
    """An immutable fitted light model of one physical unit; it belongs to one image size.

    Attributes
    ----------
    compensation : {"channel", "none"}
        Whether changes of the light are compensated, channel by channel, in the frames that it
        measures; "none" for a model that allows for them by itself.
    """

    compensation: ClassVar[Compensation] = "channel"

    def prepared(self, *, compiled: bool) -> Self:
        """Return the calibration that one pipeline uses; this very one, as here, for most.

        Parameters
        ----------
        compiled : bool
            Whether the pipeline uses compiled loops, for a model that has some.
        """
        return self

    @abstractmethod
    def measure(self, frame: Frame, reference: Reference) -> Gradients | HeightMap:
        """Turn one frame into slopes (some models give depth directly).

        Raises
        ------
        CalibrationError
            The frame has another size, number of channels or bit depth than the model was fitted
            on.
        """
