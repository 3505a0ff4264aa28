"""Depth from darkness, for a translucent gel that darkens where it is pressed, as in 9DTact.

The depth is a cubic polynomial of the logarithm of the darkening, the same all over the image.

References
----------
.. [1] C. Lin et al., "9DTact: A Compact Vision-Based Tactile Sensor for Accurate 3D Shape
   Reconstruction and Generalizable 6D Force Estimation", IEEE RA-L 9(2), 2024.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core import (
    Calibration,
    CalibrationError,
    Calibrator,
    Frame,
    HeightMap,
    Press,
    Reference,
)

Float32 = NDArray[np.float32]

FILE = "darkness.npz"
"""Name of the saved model in a bundle."""

SMOOTHING_PX = 1.5
"""Standard deviation of the smoothing of the darkening, px."""


class Darkness(Calibration):
    """Depth as a polynomial of the darkening.

    Parameters
    ----------
    weights : (3,) float64
        Depth in mm for each power of :func:`darkening`.
    shape : (H, W, K)
        Shape of the images in the fit.
    """

    def __init__(self, weights: NDArray[np.float64], shape: tuple[int, ...]) -> None:
        self._weights, self._shape = weights, shape

    def measure(self, frame: Frame, reference: Reference) -> HeightMap:
        """Return the depth of one frame."""
        for pixels in (frame.pixels, reference.pixels):
            if pixels.shape != self._shape:
                raise CalibrationError(
                    f"example_depth.darkness was fitted to images of {self._shape}, but the input "
                    f"is {pixels.shape}; calibrate at the size of the input"
                )
        mm = (powers(darkening(frame, reference)) @ self._weights).astype(np.float32)
        return HeightMap(mm, ~frame.saturated.any(axis=2), frame.mm_per_px, frame.timestamp_s)

    def save(self, directory: Path) -> None:
        """Write ``darkness.npz``."""
        np.savez(directory / FILE, weights=self._weights, shape=self._shape)

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``darkness.npz``."""
        path = directory / FILE
        try:
            with np.load(path, allow_pickle=False) as data:
                return cls(data["weights"], tuple(int(n) for n in data["shape"]))
        except (OSError, ValueError, KeyError) as error:
            raise CalibrationError(f"{path} is missing or damaged; calibrate again") from error


class DarknessCalibrator(Calibrator):
    """Fits the polynomial to pixels of known height."""

    fits = "heights"

    def fit(self, presses: Sequence[Press], reference: Reference) -> Darkness:
        """Fit the weights to presses with known heights."""
        known = [(press, press.heights_mm) for press in presses if press.heights_mm is not None]
        if not known:
            raise CalibrationError("example_depth.darkness needs presses with known heights")
        dark = [darkening(press.frame, reference)[press.rows, press.columns] for press, _ in known]
        heights_mm = np.concatenate([heights for _, heights in known])
        weights, *_ = np.linalg.lstsq(powers(np.concatenate(dark)), heights_mm, rcond=None)
        return Darkness(np.asarray(weights, np.float64), reference.pixels.shape)


def darkening(frame: Frame, reference: Reference) -> Float32:
    """Return the (H, W) logarithm of the reference's over the frame's intensity."""
    floor = np.float32(0.01 * reference.full_scale)
    planes = [
        np.maximum(pixels.astype(np.float32).mean(axis=2), floor)
        for pixels in (reference.pixels, frame.pixels)
    ]
    return np.asarray(cv2.GaussianBlur(np.log(planes[0] / planes[1]), (0, 0), SMOOTHING_PX))


def powers(dark: Float32) -> NDArray[np.float64]:
    """Return the first three powers of the darkening, (..., 3)."""
    return np.stack([dark, dark**2, dark**3], axis=-1).astype(np.float64)
