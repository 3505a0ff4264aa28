"""Distance between two equal imprints, such as two balls or the two tips of a calliper."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.circles.symmetry import vertex

_BLUR_PX = 1.0  # Standard deviation of the smoothing, px: noise would sharpen the central peak
_LEAST_LIGHT = 0.02  # Share of the brightest pixel: the logarithm of darker ones is noise

# Least correlation: two equal imprints have 0.5, single balls on recordings less than this.
_ALIKE = 0.25

_APART = 1.5  # Least distance, radii of the central peak: closer imprints share their slopes


def imprint_distance(pixels: Array, reference: Array) -> tuple[float, float] | None:
    """Measure the vector from one imprint to the other by the autocorrelation of the change.

    Parameters
    ----------
    pixels, reference : (H, W) or (H, W, K)
        The gel with both imprints, and undeformed.

    Returns
    -------
    (dx, dy) in px, dx not negative, or None
        None without two imprints of the same shape.
    """
    least = _LEAST_LIGHT * max(float(np.max(reference)), 1e-9)
    pressed, rest = (
        np.log(np.maximum(np.asarray(image, np.float32), least)) for image in (pixels, reference)
    )
    change = np.atleast_3d(cv2.GaussianBlur(pressed - rest, (0, 0), _BLUR_PX))
    change = change - np.median(change, axis=(0, 1))
    height, width = change.shape[:2]
    size = (2 * height, 2 * width)
    spectrum = np.fft.rfft2(change, s=size, axes=(0, 1))
    alike = np.fft.fftshift(np.fft.irfft2((np.abs(spectrum) ** 2).sum(axis=2), s=size))
    alike /= max(float(alike[height, width]), 1e-9)
    y, x = np.mgrid[-height:height, -width:width]
    distance = np.hypot(x, y)
    ring = distance.astype(int).ravel()
    profile = np.bincount(ring, alike.ravel()) / np.bincount(ring)
    far = (distance > _APART * int(np.argmax(profile < 0))) & (x >= 0)
    row, column = np.unravel_index(int(np.where(far, alike, -1).argmax()), alike.shape)
    inside = 0 < row < 2 * height - 1 and 0 < column < 2 * width - 1
    if not inside or alike[row, column] < _ALIKE:
        return None
    across, down = alike[row, column - 1 : column + 2], alike[row - 1 : row + 2, column]
    return float(x[row, column] + vertex(across)), float(y[row, column] + vertex(down))
