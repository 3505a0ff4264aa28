"""Pixels of dark spots: those above a threshold that is relative to the nearest peak."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.markers.contrast import FULL, square
from tactile_core.algorithms.markers.parameters import DETECTION

_SQUARES = np.arange(FULL + 1) ** 2


class SpotPixels(NamedTuple):
    """Pixels of the dark spots of a frame.

    Attributes
    ----------
    dark : (h, w) uint8
        Not 0 on spots.
    weight : (h, w) uint8
        Contrast that is counted, on spots and on their rims.
    peaks : (h, w) uint8
        Maximum contrast in the neighbourhood of each pixel.
    level : float
        Peak contrast of a typical marker.
    """

    dark: UInt8
    weight: UInt8
    peaks: UInt8
    level: float


def spot_pixels(contrast: UInt8, size_px: float, *, darkest: float) -> SpotPixels:
    """Find the pixels of the dark spots of a frame.

    Parameters
    ----------
    contrast : (h, w) uint8
        From :func:`tactile_core.algorithms.markers.contrast_of`.
    size_px : float
        Diameter of a marker, in pixels of the contrast.
    darkest : float
        Lower bound of the typical contrast.

    Returns
    -------
    SpotPixels
    """
    smoothing = int(DETECTION.smoothing_diameters * size_px)
    opening, reach = (
        int(diameters * size_px / 2)
        for diameters in (DETECTION.opening_diameters, DETECTION.peak_diameters)
    )
    smooth = _smoothed(contrast, smoothing)
    thick = np.asarray(cv2.morphologyEx(smooth, cv2.MORPH_OPEN, square(opening)), np.uint8)
    peaks = np.asarray(cv2.dilate(thick, square(reach)), np.uint8)
    level = max(_typical_contrast(peaks), darkest)
    local_threshold = cv2.convertScaleAbs(peaks, alpha=DETECTION.marker_share)
    above_local = cv2.compare(thick, local_threshold, cv2.CMP_GT)
    _, above_global = cv2.threshold(thick, DETECTION.min_contrast * level, FULL, cv2.THRESH_BINARY)
    background = cv2.convertScaleAbs(peaks, alpha=DETECTION.background_share)
    dark = np.asarray(cv2.bitwise_and(above_local, above_global), np.uint8)
    weight = np.asarray(cv2.subtract(smooth, background), np.uint8)
    return SpotPixels(dark, weight, peaks, level)


def _smoothed(contrast: UInt8, reach: int) -> UInt8:
    return np.asarray(cv2.GaussianBlur(contrast, (2 * reach + 1,) * 2, 0), np.uint8)


def _typical_contrast(peaks: UInt8) -> float:
    """Peak contrast of a typical marker.

    Much of the image is near a marker and has its peak. Pixels are weighted by the square of their
    peak, so that grain between markers that are far apart does not count.
    """
    step = DETECTION.sample_step_px
    counts = np.bincount(peaks[::step, ::step].ravel(), minlength=FULL + 1)
    weight = np.cumsum(counts * _SQUARES)
    return float(weight.searchsorted(weight[-1] / 2))
