"""The lattice of printed markers: whether there is one, how large they are and how far apart."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.pitch import spacings
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.markers.contrast import brightness_of, check_image, surroundings

_LEAST_DOT_PX = 3.0
_SIZE_STEP = 1.25
_ALIKE = 1.45
_LEAST_CONTRAST = 0.1
_LEAST_DOTS = 12
_LEAST_REGULAR = 0.7


def find_marker_diameter(pixels: Array) -> tuple[float, float] | None:
    """Find whether dots are printed on the skin, how large they are and how far apart.

    Dots of many sizes are tried. Those count that are as large as tried, alike in area, compact,
    and that lie in a lattice: most have their nearest neighbours at much the same distance.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K) uint8, uint16 or float32
        The untouched skin.

    Returns
    -------
    (diameter_px, pitch_px) or None
        None where there are no twelve such dots.
    """
    check_image(pixels)
    largest_px = min(pixels.shape[:2]) / 10
    count = max(0, int(np.log(largest_px / _LEAST_DOT_PX) / np.log(_SIZE_STEP)) + 1)
    tried = [_lattice(pixels, _LEAST_DOT_PX * _SIZE_STEP**i) for i in range(count)]
    found = [lattice for lattice in tried if lattice is not None]
    if not found:
        return None
    _, diameter_px, pitch_px = max(found)
    return diameter_px, pitch_px


def _lattice(pixels: Array, diameter_px: float) -> tuple[float, float, float] | None:
    """(score, diameter, pitch) of the dots that are about this large, if they form a lattice."""
    brightness = cv2.GaussianBlur(
        brightness_of(pixels, 1).astype(np.float32), (0, 0), 0.3 + 0.08 * diameter_px
    )
    closed = surroundings(brightness, diameter_px)
    contrast = (closed - brightness) / closed
    typical = _typical_peak(contrast, diameter_px)
    centres, sizes = _compact_spots(contrast > 0.5 * typical)
    alike = np.abs(np.log(sizes / diameter_px)) < np.log(_ALIKE)
    if typical < _LEAST_CONTRAST or alike.sum() < _LEAST_DOTS:
        return None
    centres, sizes = centres[alike], sizes[alike]
    nearest = spacings(centres)
    pitch = float(np.median(nearest))
    regular = np.abs(nearest / pitch - 1) < 0.2
    if regular.sum() < max(_LEAST_DOTS, _LEAST_REGULAR * alike.size):
        return None
    size = float(np.median(sizes[regular]))
    if pitch < 1.5 * size:
        return None
    # all the light that the dots take: corners and crumbs of larger dots may be a lattice as well
    return float(regular.sum()) * size**2 * typical, size, pitch


def _typical_peak(contrast: Array, diameter_px: float) -> float:
    from scipy.ndimage import maximum

    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        (contrast > _LEAST_CONTRAST).view(np.uint8)
    )
    large = np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] > 0.2 * diameter_px**2) + 1
    if not large.size:
        return 0.0
    return float(np.median(maximum(contrast, np.asarray(labels, np.intp), large)))


def _compact_spots(dark: Bool) -> tuple[Array, Array]:
    """Centres (N, 2) and diameters (N,) of the round or square spots that lie within the image."""
    _, _, stats, centres = cv2.connectedComponentsWithStats(dark.view(np.uint8))
    x, y, width, height, area = stats.T
    inside = (x > 0) & (y > 0) & (x + width < dark.shape[1]) & (y + height < dark.shape[0])
    compact = (area > 0.55 * width * height) & (
        np.maximum(width, height) < 2 * np.minimum(width, height)
    )
    keep = inside & compact & (area > 3)
    return centres[keep], np.sqrt(4 * area[keep] / np.pi)
