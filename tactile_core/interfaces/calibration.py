"""What maps images to slopes on one unit, and what fits it: calibrations and calibrators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Light
from tactile_core.quantities import Float32, Frame, Gradients, HeightMap, Quantity, Reference

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


@dataclass(frozen=True, eq=False)
class Press(Quantity):
    """Pixels of one frame with ground-truth slopes, from a calibration target.

    Attributes
    ----------
    frame : Frame
    rows, columns : (N,) int32
        The pixels.
    gradients : (N, 2) float32
        True (∂z/∂x, ∂z/∂y) of each pixel; 0 where the gel surface is undeformed.
    name : str
        Name of the press's file, for messages.
    heights_mm : (N,) float32 or None
        True height of each pixel above the undeformed gel surface; None if only slopes are known.
    """

    frame: Frame
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    gradients: Float32
    name: str = ""
    heights_mm: Float32 | None = None


class Calibrator(ABC):
    """Fits calibrations; a profile names one calibrator and sets its options.

    Attributes
    ----------
    compensation : {"channel", "none"}
        Illumination compensation of the frames that it fits, the same as that of the calibrations
        that it returns.
    fits : {"slopes", "heights"}
        Which ground truth of the pixels the fit uses. Slopes are known in the inner part of a
        contact, heights in all of it: the press of a calibrator of heights reaches the rim.
    """

    Options: ClassVar[type[BaseModel]] = Options
    compensation: ClassVar[Compensation] = "channel"
    fits: ClassVar[Literal["slopes", "heights"]] = "slopes"

    def __init__(self, options: BaseModel) -> None:
        self.options = options

    @abstractmethod
    def fit(self, presses: Sequence[Press], reference: Reference) -> Calibration:
        """Fit a model; the result is deterministic.

        A calibrator that chooses among several kinds returns the model that it chose.

        Raises
        ------
        CalibrationError
            The presses do not determine the model.
        """

    def from_lights(self, lights: Sequence[Light]) -> Calibration | None:
        """Return a model that needs no bundle, computed from the lights' nominal positions.

        The default, None, means that the calibrator offers no such model. The model must also
        work without a reference: it then receives one of uniform intensity.
        """
        return None

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the standard deviation in px of the smoothing that the fitted model applies.

        A height map that serves as calibration target is smoothed by the same amount; otherwise
        fine grooves are reconstructed too deep. The default, 0, is for a model without smoothing.
        """
        return 0.0


class Progress(Protocol):
    """Receives progress reports; the command line draws a bar."""

    def stage(self, words: str, share: float) -> None:
        """Start a stage that takes about this share of the whole."""

    def fraction(self, done: float) -> None:
        """Report the completed fraction of the current stage, 0..1."""


class Silent:
    """A :class:`Progress` that displays nothing."""

    def stage(self, words: str, share: float) -> None:
        """Do nothing."""

    def fraction(self, done: float) -> None:
        """Do nothing."""
