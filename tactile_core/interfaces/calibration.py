"""What maps images to slopes on one unit, what fits it, and the size of its errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.artefact import Artefact
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Light
from tactile_core.quantities import Float32, Frame, Gradients, HeightMap, Quantity, Reference
from tactile_core.quantities.quantity import grid_of, on_demand, replace_values

Compensation = Literal["channel", "none"]

_ERRORS = "errors.npz"


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
    refusal : str
        For a sensor whose light measures no slopes: a sentence that says so and what to do
        instead. Empty for any other.
    """

    Options: ClassVar[type[BaseModel]] = Options
    compensation: ClassVar[Compensation] = "channel"
    fits: ClassVar[Literal["slopes", "heights"]] = "slopes"
    refusal: ClassVar[str] = ""

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


@dataclass(frozen=True, eq=False)
class SlopeErrors(Artefact):
    """Size of the errors of slope of one calibrated unit.

    Attributes
    ----------
    slopes, std : (M,) float32
        Standard deviation of a component against the measured slope, which increases.
    gain_std : float
        Relative standard deviation of a factor that all slopes of a frame have in common.
    correlation_mm : float
        Errors are correlated within this distance.
    """

    slopes: Float32
    std: Float32
    gain_std: float
    correlation_mm: float

    def __post_init__(self) -> None:
        numbers = np.array([self.gain_std, self.correlation_mm, *self.std])
        if (
            self.slopes.ndim != 1
            or self.slopes.shape != self.std.shape
            or not self.slopes.size
            or not np.isfinite([*numbers, *self.slopes]).all()
            or (numbers < 0).any()
            or (np.diff(self.slopes) < 0).any()
        ):
            raise CalibrationError("a table of errors needs increasing slopes and positive errors")

    def added_to(self, gradients: Gradients) -> Gradients:
        """Return the slopes of a frame, with their standard deviation."""
        # opening a sensor loads no algorithms that its profile does not use
        from tactile_core.algorithms.slopes.slope_field import slope_std

        gx, gy = grid_of(gradients, "x"), grid_of(gradients, "y")
        return replace_values(
            gradients,
            std_cells=on_demand(
                lambda: slope_std(gx.cells, gy.cells, self.slopes, self.std, step_px=gx.step_px)
            ),
            gain_std=self.gain_std,
            correlation_mm=self.correlation_mm,
            calibrated_slope=float(self.slopes[-1]),
        )

    def save(self, directory: Path) -> None:
        """Write ``errors.npz``."""
        write_npz(directory / _ERRORS, {name: np.asarray(v) for name, v in vars(self).items()})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``errors.npz``.

        Raises
        ------
        CalibrationError
            The file is missing or damaged.
        """
        path = directory / _ERRORS
        try:
            arrays = read_npz(path)
            slopes, std = (np.asarray(arrays[name], np.float32) for name in ("slopes", "std"))
            return cls(slopes, std, float(arrays["gain_std"]), float(arrays["correlation_mm"]))
        except (InputError, ValueError, LookupError, TypeError) as error:
            raise CalibrationError(f"{path} does not hold errors; calibrate again") from error
