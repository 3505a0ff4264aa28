"""Depth from an image by ridge regression, without gradients as an intermediate step.

To first order, the intensity change of a channel is proportional to the slope towards its light.
Its integral along x or y is then proportional to the depth. The factors are fitted for each
channel, with linear terms of the position.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactile_core import (
    Calibration,
    CalibrationError,
    Calibrator,
    Frame,
    HeightMap,
    Press,
    Reference,
)
from tactile_core.algorithms.poisson import integrate
from tactile_core.interfaces.device import Options

Float32 = NDArray[np.float32]

FILE = "ridge_depth.npz"
"""Name of the saved model in a bundle."""


class RidgeDepth(Calibration):
    """Depth as a weighted sum of integrated intensity changes.

    Parameters
    ----------
    weights : (F,) float32
        Weights of the :func:`features`.
    shape : (H, W, K)
        Shape of the images in the fit.
    """

    def __init__(self, weights: Float32, shape: tuple[int, ...]) -> None:
        self._weights, self._shape = weights, shape

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        """Return the depth of one frame."""
        for pixels in (frame.pixels, reference.pixels):
            if pixels.shape != self._shape:
                raise CalibrationError(
                    f"example_depth.ridge was fitted to images of {self._shape}, but the input is "
                    f"{pixels.shape}; calibrate at the size of the input"
                )
        mm = features(frame, reference) @ self._weights
        return HeightMap(mm, ~frame.saturated.any(axis=2), frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``ridge_depth.npz``."""
        np.savez(directory / FILE, weights=self._weights, shape=self._shape)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``ridge_depth.npz``."""
        path = directory / FILE
        try:
            with np.load(path, allow_pickle=False) as data:
                return cls(data["weights"], tuple(int(n) for n in data["shape"]))
        except (OSError, ValueError, KeyError) as error:
            raise CalibrationError(f"{path} is missing or damaged; calibrate again") from error


class RidgeOptions(Options):
    """Options of ``use: example_depth.ridge`` in a profile."""

    ridge: float = Field(default=1e-4, gt=0, description="Penalty on the squared weights.")


class RidgeDepthCalibrator(Calibrator):
    """Fits the weights to pixels of known height."""

    Options = RidgeOptions
    options: RidgeOptions
    fits = "heights"

    def fit(self, presses: Sequence[Press], reference: Reference) -> RidgeDepth:
        """Fit the weights to presses with known heights."""
        known = [(press, press.heights_mm) for press in presses if press.heights_mm is not None]
        if not known:
            raise CalibrationError("example_depth.ridge needs presses with known heights")
        rows = [features(p.frame, reference)[p.rows, p.columns] for p, _ in known]
        a = np.concatenate(rows).astype(np.float64)
        b = np.concatenate([heights_mm for _, heights_mm in known])
        normal = a.T @ a + self.options.ridge * len(a) * np.eye(a.shape[1])
        weights = np.linalg.solve(normal, a.T @ b)
        return RidgeDepth(weights.astype(np.float32), reference.pixels.shape)


def features(frame: Frame, reference: Reference) -> Float32:
    """Return (H, W, 6 K) integrals in mm of each channel's change, also times x and times y."""
    change = frame.pixels / np.maximum(reference.pixels, 0.01 * reference.full_scale) - 1
    none = np.zeros(change.shape[:2], np.float32)
    integrals = []
    for channel in np.moveaxis(change.astype(np.float32), -1, 0):
        for slopes in ((channel, none), (none, channel)):
            integral = integrate(*slopes, mm_per_px=frame.mm_per_px)
            # fixes the free constant of the integral: most of the image is not in contact
            integrals.append(integral - np.median(integral))
    terms = np.stack(integrals, axis=-1)
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) for n in none.shape)
    return np.concatenate([terms, terms * x[:, None], terms * y[:, None, None]], axis=-1)
