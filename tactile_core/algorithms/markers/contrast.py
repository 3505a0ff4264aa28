"""How much darker each pixel is than its surroundings: mask and detection start from it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.arrays.types import Array, UInt8
from tactile_core.errors import InputError

FULL = 255
"""Darkness of a pixel that has lost all light."""

_CLOSING_DIAMETERS = 2.2
_FLOOR_SHARE = 0.08
_COARSE_DOT_PX = 6.0


def contrast_of(pixels: Array, *, diameter_px: float) -> UInt8:
    """Share of the light of its surroundings that each pixel lacks.

    The paper subtracts a blurred first frame; here the surroundings come from the frame itself, the
    closing that bridges what is dark and smaller than 2.2 markers. The mean of the channels hardly
    changes with the colour of light or slope, and shading and shadows wider than a marker are their
    own surroundings. Large markers are looked at with reduced resolution.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Size of a marker.

    Returns
    -------
    (H // n, W // n) uint8
        255 where all light is lost; n is 1 to 4, such that a marker still measures 6 pixels.

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    check_image(pixels)
    if not diameter_px > 0:
        raise InputError(f"markers of {diameter_px} px cannot be found; give a positive diameter")
    times = max(1, min(4, int(diameter_px / _COARSE_DOT_PX)))
    brightness = brightness_of(pixels, times)
    around = surroundings(brightness, diameter_px / times)
    lost = cv2.subtract(around, brightness)
    if lost.dtype == np.uint8:
        return np.asarray(cv2.divide(lost, around, scale=FULL), np.uint8)
    return np.asarray(cv2.convertScaleAbs(cv2.divide(lost, around, scale=FULL, dtype=cv2.CV_32F)))


def check_image(pixels: Array) -> None:
    """Refuse what is no image.

    Raises
    ------
    InputError
    """
    if pixels.ndim not in (2, 3) or 0 in pixels.shape:
        raise InputError(f"an image is (H, W) or (H, W, K); this one is {pixels.shape}")


def brightness_of(pixels: Array, times: int) -> Array:
    """(h, w) mean of the channels, shrunk by a whole factor."""
    if times > 1:
        height, width = pixels.shape[:2]
        pixels = shrunk(pixels, (max(1, width // times), max(1, height // times)))
    if pixels.ndim == 2:
        return pixels
    if pixels.shape[2] == 3 and pixels.dtype == np.uint8:
        # a third of the time of the general way, and to the same byte
        first, second, third = cv2.split(pixels)
        total = cv2.add(first, second, dtype=cv2.CV_16U)
        total = cv2.add(total, third, dtype=cv2.CV_16U)
        return np.asarray(cv2.convertScaleAbs(total, alpha=1 / 3))
    share = np.full((1, pixels.shape[2]), 1 / pixels.shape[2], np.float32)
    return cv2.transform(pixels, share).reshape(pixels.shape[:2])


def surroundings(brightness: Array, diameter_px: float) -> Array:
    """Brightness of the surroundings, bounded from below where it is too dark to compare."""
    side = 2 * round(0.5 * _CLOSING_DIAMETERS * diameter_px) + 1
    closed = cv2.morphologyEx(brightness, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    full = 255.0 if closed.dtype == np.uint8 else max(float(closed.max()), 1e-6)
    floor: Any = _FLOOR_SHARE * full  # numbers are taken as well, which the types do not say
    return np.asarray(cv2.max(closed, floor))
