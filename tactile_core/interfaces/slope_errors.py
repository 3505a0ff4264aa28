"""The artefact with the size of a unit's errors of slope, measured on held-out presses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.artefact import Artefact
from tactile_core.quantities import Float32, Gradients
from tactile_core.quantities.quantity import grid_of, on_demand, replace_values

_FILE = "errors.npz"


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
        )

    def save(self, directory: Path) -> None:
        """Write ``errors.npz``."""
        write_npz(directory / _FILE, {name: np.asarray(v) for name, v in vars(self).items()})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``errors.npz``.

        Raises
        ------
        CalibrationError
            The file is missing or damaged.
        """
        path = directory / _FILE
        try:
            arrays = read_npz(path)
            slopes, std = (np.asarray(arrays[name], np.float32) for name in ("slopes", "std"))
            return cls(slopes, std, float(arrays["gain_std"]), float(arrays["correlation_mm"]))
        except (InputError, ValueError, LookupError, TypeError) as error:
            raise CalibrationError(f"{path} does not hold errors; calibrate again") from error
