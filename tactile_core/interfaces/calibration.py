"""The calibration interface: from the intensities of one physical unit to slopes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.interfaces.device import Options
from tactile_core.quantities import Float32, Frame, Gradients, HeightMap, Quantity, Reference

Compensation = Literal["channel", "none"]


@dataclass(frozen=True, eq=False)
class Press(Quantity):
    """Pixels of one frame whose slope is known, because a known shape lies on them.

    Attributes
    ----------
    frame : Frame
    rows, columns : (N,) int32
        The pixels.
    gradients : (N, 2) float32
        (∂z/∂x, ∂z/∂y) there; 0 for skin that is known to be at rest.
    name : str
        The press's file, for messages.
    """

    frame: Frame
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    gradients: Float32
    name: str = ""


class Calibration(ABC):
    """An immutable fitted model of one physical unit; it belongs to one image size.

    Attributes
    ----------
    compensation : {"channel", "none"}
        Whether changes of the light are compensated, channel by channel, in the frames that it is
        fitted on and measures; "none" for a model that allows for them by itself.
    """

    Options: ClassVar[type[BaseModel]] = Options
    compensation: ClassVar[Compensation] = "channel"

    @classmethod
    @abstractmethod
    def fit(cls, samples: Sequence[Press], reference: Reference, options: BaseModel) -> Calibration:
        """Fit the model.

        Usually returns an instance of ``cls``; a model that chooses among others returns its
        choice.

        Raises
        ------
        CalibrationError
            The samples do not determine the model.
        """

    @classmethod
    def from_lights(
        cls, options: BaseModel, azimuth_deg: Sequence[float], elevation_deg: Sequence[float]
    ) -> Calibration | None:
        """Return what can be measured with no bundle, from where the profile has the lights.

        None, as here, where nothing can, or where the options do not ask for it. What is returned
        has to measure without a reference, too: it is given one of equal intensities.
        """
        return None

    @abstractmethod
    def measure(self, frame: Frame, reference: Reference) -> Gradients | HeightMap:
        """Turn one frame into slopes (some sensors give depth directly)."""

    @abstractmethod
    def save(self, directory: Path) -> None:
        """Write the model's files into an existing directory, without pickles."""

    @classmethod
    @abstractmethod
    def load(cls, directory: Path) -> Self:
        """Read what :meth:`save` wrote.

        Raises
        ------
        CalibrationError
            The files are missing, broken or newer than this version.
        """
