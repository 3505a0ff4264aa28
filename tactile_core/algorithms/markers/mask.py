"""The mask of the printed markers, which hide the gel surface."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import repeated
from tactile_core.algorithms.arrays.types import Array, Bool, UInt8
from tactile_core.algorithms.markers.contrast import CONTRAST, FULL, contrast_of, square


def marker_mask(
    pixels: Array, *, diameter_px: float, contrast: float = CONTRAST.masked_contrast
) -> Bool:
    """Mask the dark markers of an image, with a rim of one pixel.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Diameter of a marker.
    contrast : float
        Minimum share of the light that a marker absorbs.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    return mask_of(
        contrast_of(pixels, diameter_px=diameter_px), pixels.shape[:2], min_contrast=contrast
    )


def mask_of(
    contrast: UInt8,
    shape: tuple[int, ...],
    *,
    min_contrast: float = CONTRAST.masked_contrast,
) -> Bool:
    """Threshold the marker contrast, and add a rim of one pixel.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`contrast_of`.
    shape : (H, W)
        Shape of the image.
    min_contrast : float
        Minimum share of the light that a marker absorbs.

    Returns
    -------
    (H, W) bool
    """
    _, above = cv2.threshold(contrast, min_contrast * FULL, 1, cv2.THRESH_BINARY)
    dark = np.asarray(above, np.uint8)
    return np.asarray(cv2.dilate(repeated(dark, shape), square(1))).view(np.bool_)
