"""Pixels whose slope can be measured: enough channels are neither too dark nor saturated."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.photometric import planes_of


def two_within(pixels: NDArray[Any], floor: float, ceiling: float) -> NDArray[np.uint8]:
    """Find the pixels with at least two channels between two bounds.

    A slope has two components, so it takes two channels. Images of a single channel need that one.

    Parameters
    ----------
    pixels : (H, W, K) uint8, uint16 or float32
    floor, ceiling : float
        Exclusive bounds, in the units of ``pixels``.

    Returns
    -------
    (H, W) uint8
        1 where enough channels are within the bounds, else 0.
    """
    rows, columns, channels = pixels.shape
    below = float(np.nextafter(np.float32(ceiling), np.float32(0)))
    outside = np.zeros((rows, columns), pixels.dtype)
    for plane in planes_of(pixels):
        # finding the extremes is faster than thresholding, and they are rarely out of range
        darkest, brightest = cv2.minMaxLoc(plane)[:2]
        if darkest <= floor:
            outside += cv2.threshold(plane, floor, 1, cv2.THRESH_BINARY_INV)[1]
        if brightest >= ceiling:
            outside += cv2.threshold(plane, below, 1, cv2.THRESH_BINARY)[1]
    allowed: Any = channels - min(2, channels)
    valid = np.asarray(cv2.compare(outside, allowed, cv2.CMP_LE), np.uint8)
    valid &= 1
    return valid
