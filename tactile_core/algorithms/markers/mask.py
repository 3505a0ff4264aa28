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
    if shape == (2 * dark.shape[0], 2 * dark.shape[1]):
        return _doubled(dark).view(np.bool_)
    return np.asarray(cv2.dilate(repeated(dark, shape), square(1))).view(np.bool_)


def _doubled(dark: UInt8) -> UInt8:
    """Repeat each pixel of (h, w) twice along both axes and add a rim of one pixel, (2h, 2w).

    Of the two pixels, one is next to the pixel before and the other to that behind.
    """
    rows, columns = dark.shape
    flat = dark.ravel()
    sides = before, behind = np.empty((2, rows, columns), np.uint8)
    # rows follow each other, so that only their ends, which are set then, are wrong
    np.maximum(flat[1:], flat[:-1], out=before.ravel()[1:])
    behind.ravel()[:-1] = before.ravel()[1:]
    before[:, 0], behind[:, -1] = dark[:, 0], dark[:, -1]
    wide = np.asarray(cv2.merge(list(sides)), np.uint8).reshape(rows, 2 * columns)
    doubled = np.empty((rows, 2, 2 * columns), np.uint8)
    np.maximum(wide[1:], wide[:-1], out=doubled[1:, 0])
    doubled[:-1, 1] = doubled[1:, 0]
    doubled[0, 0], doubled[-1, 1] = wide[0], wide[-1]
    return doubled.reshape(2 * rows, 2 * columns)
