"""Depth straight from a picture, with no slopes in between, by ridge regression.

To first order a channel brightens as the surface turns towards its light. The integral of its
change along x or along y is then a share of the depth, and how large a share is fitted, for each
channel, with terms of the place.
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


class RidgeDepth(Calibration):
    """Depth as a weighted sum of integrated changes of the light.

    Parameters
    ----------
    weights : (F,) float32
        Of the :func:`features`.
    shape : (H, W, K)
        Of the images that they were fitted on.
    """

    def __init__(self, weights: Float32, shape: tuple[int, ...]) -> None:
        self._weights, self._shape = weights, shape

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        """Depth of one frame."""
        for pixels in (frame.pixels, reference.pixels):
            if pixels.shape != self._shape:
                raise CalibrationError(
                    f"example_depth.ridge was fitted on images of {self._shape} and is given "
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
    """What a profile may set beside ``use: example_depth.ridge``."""

    ridge: float = Field(default=1e-4, gt=0, description="Penalty on the weights.")


class RidgeDepthCalibrator(Calibrator):
    """Fits the weights to pixels of known height."""

    Options = RidgeOptions
    options: RidgeOptions

    def fit(self, presses: Sequence[Press], reference: Reference) -> RidgeDepth:
        """Fit on presses of a known shape."""
        known = [(press, press.heights_mm) for press in presses if press.heights_mm is not None]
        if not known:
            raise CalibrationError("example_depth.ridge needs presses whose height is known")
        seen = [features(p.frame, reference)[p.rows, p.columns] for p, _ in known]
        a = np.concatenate(seen).astype(np.float64)
        b = np.concatenate([heights_mm for _, heights_mm in known])
        normal = a.T @ a + self.options.ridge * len(a) * np.eye(a.shape[1])
        weights = np.linalg.solve(normal, a.T @ b)
        return RidgeDepth(weights.astype(np.float32), reference.pixels.shape)


def features(frame: Frame, reference: Reference) -> Float32:
    """(H, W, 6 K) integrals in mm of each channel's change, alone and times the place."""
    change = frame.pixels / np.maximum(reference.pixels, 0.01 * reference.full_scale) - 1
    none = np.zeros(change.shape[:2], np.float32)
    integrals = []
    for channel in np.moveaxis(change.astype(np.float32), -1, 0):
        for slopes in ((channel, none), (none, channel)):
            integral = integrate(*slopes, mm_per_px=frame.mm_per_px)
            # an integral is free by a constant: most of the image is not touched
            integrals.append(integral - np.median(integral))
    shares = np.stack(integrals, axis=-1)
    y, x = (np.linspace(-1, 1, n, dtype=np.float32) for n in none.shape)
    return np.concatenate([shares, shares * x[:, None], shares * y[:, None, None]], axis=-1)
