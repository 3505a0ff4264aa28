"""The calibrator interface: how the light model of one physical unit is obtained."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.interfaces.calibration import Calibration, Compensation
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Light
from tactile_core.quantities import Float32, Frame, Quantity, Reference


@dataclass(frozen=True, eq=False)
class Press(Quantity):
    """Pixels of one frame whose slope and height are known, for a known shape touches them.

    Attributes
    ----------
    frame : Frame
    rows, columns : (N,) int32
        The pixels.
    gradients : (N, 2) float32
        (∂z/∂x, ∂z/∂y) there; 0 where the gel surface is known to be undeformed.
    name : str
        The press's file, for messages.
    heights_mm : (N,) float32 or None
        Height there over the undeformed gel surface; None where only slopes are known.
    """

    frame: Frame
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    gradients: Float32
    name: str = ""
    heights_mm: Float32 | None = None


class Calibrator(ABC):
    """Fits calibrations; a profile names one and gives its options.

    Attributes
    ----------
    compensation : {"channel", "none"}
        In which frames it fits; that of the calibrations that it returns.
    """

    Options: ClassVar[type[BaseModel]] = Options
    compensation: ClassVar[Compensation] = "channel"

    def __init__(self, options: BaseModel) -> None:
        self.options = options

    @abstractmethod
    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        """Fit a model; the same presses give the same one.

        A calibrator that chooses among others returns the model of its choice.

        Raises
        ------
        CalibrationError
            The presses do not determine the model.
        """

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        """Return what can be measured with no bundle, from where the profile has the lights.

        None, as here, where nothing can, or where the options do not ask for it. What is returned
        has to measure without a reference, too: it is given one of equal intensities.
        """
        return None

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return how much the fitted model smooths its images: standard deviation in px.

        The slopes of a height map that is fitted on are smoothed alike, since fine grooves come
        out too deep otherwise. 0, as here, for a model that does not smooth.
        """
        return 0.0
