"""Which pixels tell a slope: those that are neither too dark nor saturated in enough channels."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.photometric import planes_of


def two_within(pixels: NDArray[Any], floor: float, ceiling: float) -> NDArray[np.uint8]:
    """Tell where at least two channels, or the only one, are between two bounds.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    floor, ceiling : float
        Neither is within.

    Returns
    -------
    (H, W) uint8
        0 or 1.
    """
    rows, columns, channels = pixels.shape
    below = float(np.nextafter(np.float32(ceiling), np.float32(0)))
    with (
        planes_of(pixels) as planes,
        borrowed((rows, columns), pixels.dtype) as outside,
        borrowed((rows, columns), pixels.dtype) as some,
    ):
        outside.fill(0)
        for plane in planes:
            # extremes are found faster than where they are, and are rarely out of range
            darkest, brightest = cv2.minMaxLoc(plane)[:2]
            if darkest <= floor:
                cv2.threshold(plane, floor, 1, cv2.THRESH_BINARY_INV, dst=some)
                cv2.add(outside, some, dst=outside)
            if brightest >= ceiling:
                cv2.threshold(plane, below, 1, cv2.THRESH_BINARY, dst=some)
                cv2.add(outside, some, dst=outside)
        spared: Any = channels - min(2, channels)
        valid = np.asarray(cv2.compare(outside, spared, cv2.CMP_LE), np.uint8)
    valid &= 1
    return valid
