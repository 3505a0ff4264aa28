"""The contrast of markers with the gel, and what a marker looks like."""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import repeat_pixels, shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, UInt8
from tactile_core.errors import InputError

FULL = 255  # Contrast of a dark marker that reflects no light at all

Tone = Literal["dark", "bright"]


# [marker diameters] Side of the square of the closing or opening that estimates the background.
# Structures that are wider than this are background: chosen on recorded markers (ADR 25)
CLOSING_DIAMETERS = 2.2
# [px] The image is reduced by a whole factor as long as a marker keeps this diameter: for speed
_COARSE_DIAMETER_PX = 6.0
# [share of the brighter] Pixels that differ by at least this share are masked as marker
_MASKED_CONTRAST = 0.12


def contrast_of(
    pixels: Array, *, diameter_px: float, tone: Tone = "dark", halves: UInt8 | None = None
) -> UInt8:
    """Return how much darker, or brighter, each pixel is than its background.

    The background is a morphological closing of the same frame, or an opening for bright markers,
    wide enough to remove a marker. The contrast is the difference divided by the background, or by
    the brightest marker within as wide a window, so it is insensitive to the strength and color of
    the illumination and to shading that is wider than a marker. The papers subtract a blurred first
    frame instead [1]_, which no longer fits once a contact changes the shading. Images with large
    markers are reduced first.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Diameter of a marker.
    tone : {"dark", "bright"}
        Whether markers are darker or brighter than the gel, in the mean over the channels.
    halves : (H / 2, W / 2, 3) uint8, optional
        The means over 2 × 2 pixels, if they are known.

    Returns
    -------
    (H // n, W // n) uint8
        0 for the background, 255 for a pixel without any light, or on a background without any.
        The factor n is 1 to 4; a reduced marker still measures 6 pixels.

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """
    check_image(pixels)
    if not diameter_px > 0:
        raise InputError(f"markers of {diameter_px} px cannot be found; give a positive diameter")
    times = reduction(diameter_px)
    size_px = diameter_px / times
    if halves is not None and times % 2 == 0:
        pixels, times = halves, times // 2
    brightness = brightness_of(pixels, times)
    if brightness.dtype != np.uint8:
        brightness = brightness.astype(np.float32)
    contrast = compare_with_background(brightness, size_px, tone=tone, scale=FULL)
    return np.asarray(cv2.convertScaleAbs(contrast))


def reduction(diameter_px: float) -> int:
    """Factor by which an image is reduced before the contrast of such markers is measured."""
    return max(1, min(4, int(diameter_px / _COARSE_DIAMETER_PX)))


def check_image(pixels: Array) -> None:
    """Check the shape of an image.

    Raises
    ------
    InputError
        The shape is not (H, W) or (H, W, K), or the image is empty.
    """
    if pixels.ndim not in (2, 3) or 0 in pixels.shape:
        raise InputError(f"an image is (H, W) or (H, W, K); this one is {pixels.shape}")


def brightness_of(pixels: Array, times: int) -> Array:
    """(h, w) mean of the channels of an image that is reduced by a whole factor."""
    pixels = _shrink_pixels(pixels, times)
    if pixels.ndim == 2:
        return pixels
    share = np.full((1, pixels.shape[2]), 1 / pixels.shape[2], np.float32)
    return cv2.transform(pixels, share).reshape(pixels.shape[:2])


def compare_with_background(
    brightness: Array, diameter_px: float, *, tone: Tone, scale: float = 1.0
) -> Array:
    """Return the contrast (h, w) of a brightness with its background, 0 to ``scale``, same dtype.

    The brightness is uint8 or float32.
    """
    window = square(round(0.5 * CLOSING_DIAMETERS * diameter_px))
    method = cv2.MORPH_CLOSE if tone == "dark" else cv2.MORPH_OPEN
    background = cv2.morphologyEx(brightness, method, window)
    full = FULL if brightness.dtype == np.uint8 else max(float(brightness.max()), 1e-6)
    # [share of full scale] noise in a dark image is no contrast; OpenCV's type hints omit scalars
    darkest: Any = 0.08 * full
    background = cv2.max(background, darkest)
    if tone == "dark":
        difference, brightest = cv2.subtract(background, brightness), background
    else:
        above = cv2.max(brightness, background)
        difference, brightest = cv2.subtract(above, background), cv2.dilate(above, window)
    return np.asarray(cv2.divide(difference, brightest, scale=scale))


def _shrink_pixels(pixels: Array, times: int) -> Array:
    if times == 1:
        return pixels
    height, width = pixels.shape[:2]
    return shrink_image(pixels, (max(1, width // times), max(1, height // times)))


@cache
def square(reach: int) -> UInt8:
    """Return the structuring element of all pixels within ``reach`` rows and columns."""
    return np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)


def marker_mask(
    pixels: Array,
    *,
    diameter_px: float,
    tone: Tone = "dark",
    contrast: float = _MASKED_CONTRAST,
) -> Bool:
    """Mask the markers of an image, with a rim of one pixel.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Diameter of a marker.
    tone : {"dark", "bright"}
        Whether markers are darker or brighter than the gel.
    contrast : float
        Minimum contrast of a marker, as a share of the brighter of marker and gel.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    found = contrast_of(pixels, diameter_px=diameter_px, tone=tone)
    return mask_of(found, pixels.shape[:2], min_contrast=contrast)


def mask_of(
    contrast: UInt8,
    shape: tuple[int, ...],
    *,
    min_contrast: float = _MASKED_CONTRAST,
) -> Bool:
    """Threshold the marker contrast, and add a rim of one pixel.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`contrast_of`.
    shape : (H, W)
        Shape of the image.
    min_contrast : float
        Minimum contrast of a marker, as a share of the brighter of marker and gel.

    Returns
    -------
    (H, W) bool
    """
    _, above = cv2.threshold(contrast, min_contrast * FULL, 1, cv2.THRESH_BINARY)
    marked = np.asarray(above, np.uint8)
    return np.asarray(cv2.dilate(repeat_pixels(marked, shape), square(1))).view(np.bool_)
