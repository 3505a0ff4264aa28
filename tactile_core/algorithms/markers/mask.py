"""Which pixels show a printed marker instead of the skin."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.shrinking import repeated
from tactile_core.algorithms.arrays.types import Array, Bool, UInt8
from tactile_core.algorithms.markers.contrast import FULL, contrast_of

_LEAST_CONTRAST = 0.12


def marker_mask(pixels: Array, *, diameter_px: float, contrast: float = _LEAST_CONTRAST) -> Bool:
    """Mask dark dots, with a rim of one pixel.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The image.
    diameter_px : float
        Size of a dot.
    contrast : float
        Share of light that a dot takes away, at least.

    Returns
    -------
    (H, W) bool

    Raises
    ------
    InputError
        The image is not (H, W, K), or the diameter is not positive.
    """
    return mask_of(contrast_of(pixels, diameter_px=diameter_px), pixels.shape[:2], least=contrast)


def mask_of(contrast: UInt8, shape: tuple[int, ...], *, least: float = _LEAST_CONTRAST) -> Bool:
    """Mask what lacks light, with a rim of one pixel.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`contrast_of`.
    shape : (H, W)
        Of the image.
    least : float
        Share of light that a dot takes away, at least.

    Returns
    -------
    (H, W) bool
    """
    _, dark = cv2.threshold(contrast, least * FULL, 1, cv2.THRESH_BINARY)
    dark = repeated(np.asarray(dark, np.uint8), shape)
    return np.asarray(cv2.dilate(dark, np.ones((3, 3), np.uint8)), np.uint8).view(np.bool_)
