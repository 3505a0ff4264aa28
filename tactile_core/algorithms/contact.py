"""Which part of the skin the object touches, told from the height map."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.gradient import steepness
from tactile_core.algorithms.arrays.quantile import quantile, sigma_of
from tactile_core.algorithms.arrays.shrinking import repeated, shrunk
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.errors import InputError

_COARSE_PX = 160 * 120
_NOISE_SAMPLES = 4000
_SEEN_SIGMAS = 5.0
_REGION_SIGMAS = 2.5
_RAYLEIGH_QUARTILE = 0.7585
_BANDS, _HIGHEST_BAND = 20, 11
_BLUNT = 0.8
"""The steepest contour of a smoothed map lies within the border, at so much more of the depth."""
_MOST_NOISE = 0.1
"""Of the greatest height: skin beside a wide contact bulges away from the camera, evenly and by up
to a third of the depth, and is no noise."""


def contact_mask(
    height_mm: Array,
    *,
    mm_per_px: float,
    min_indentation_mm: float = 0.03,
    border_fraction: float | None = None,
    min_slope: float = 0.1,
    min_area_mm2: float = 0.05,
) -> Bool:
    """Find where the object touches.

    A region of raised skin is a contact when it is

    - deep: somewhere indented by ``min_indentation_mm`` and by 5 times the noise of the height;
    - steep: somewhere sloped by ``min_slope`` and by 5 times the noise of the slope, for a contact
      has a flank, and drift, which may add up to any height, has none;
    - large: ``min_area_mm2``, the flank as well, so that specks are left out.

    Both noises come from the map itself: from what lies below the rest surface, where no contact
    is, up to a tenth of the greatest height, and from the calmest quarter of the slopes.

    The skin around a contact is drawn down with it, so the border is not where the indentation
    ends. It is where the skin leaves the object and its slope falls off: at half the depth of a
    ball that touches little of the skin (Hertz), and the lower, the wider the contact is beside
    the gel's thickness. So it is told from the contour of the region that is steepest on average;
    the steep wall of a flat-ended object is cut at much the same place by any fraction. What is
    less deep than the border of its deepest neighbour in the same region, say the high side of a
    strongly tilted plate, is missed.

    Parameters
    ----------
    height_mm : (H, W) float32
        0 at rest, positive where pressed.
    mm_per_px : float
        Scale of the image.
    min_indentation_mm, min_slope, min_area_mm2 : float
        As above.
    border_fraction : float, optional
        Depth at the border over the greatest depth of the region, if it is known.

    Returns
    -------
    (H, W) bool
        All False when nothing touches.

    Raises
    ------
    InputError
        The height map is not 2-D or empty.
    """
    if height_mm.ndim != 2 or 0 in height_mm.shape:
        raise InputError(f"a height map is (H, W); this one is {height_mm.shape}")
    height_mm = np.asarray(height_mm, np.float32)
    mask = np.zeros(height_mm.shape, np.uint8)
    shrink = max(1, round(np.sqrt(height_mm.size / _COARSE_PX)))
    size = max(1, height_mm.shape[1] // shrink), max(1, height_mm.shape[0] // shrink)
    coarse = shrunk(height_mm, size)
    noise_mm = min(_height_noise(coarse), _MOST_NOISE * float(coarse.max()))
    low_mm = max(min_indentation_mm, _REGION_SIGMAS * noise_mm)
    seen_mm = max(min_indentation_mm, _SEEN_SIGMAS * noise_mm)
    if coarse.max() <= seen_mm:
        return mask.view(bool)
    slope = steepness(coarse, shrink * mm_per_px)
    steep = slope > max(min_slope, _SEEN_SIGMAS * _slope_noise(slope))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        (coarse > low_mm).view(np.uint8), connectivity=8, ltype=cv2.CV_16U
    )
    min_area_px = min_area_mm2 / (shrink * mm_per_px) ** 2
    large = stats[:, cv2.CC_STAT_AREA] >= min_area_px
    for label in np.flatnonzero(large[1:]) + 1:
        x, y, width, height = (int(value) for value in stats[label, :4])
        window = np.s_[y : y + height, x : x + width]
        region = labels[window] == label
        peak_mm = float(coarse[window][region].max())
        flank = np.count_nonzero(region & steep[window])
        if peak_mm > seen_mm and flank >= max(1, min_area_px):
            share = border_fraction
            if share is None:
                share = _border(coarse[window][region] / peak_mm, slope[window][region])
            border_mm = max(low_mm, share * peak_mm)
            touched = _without_specks(region & (coarse[window] > border_mm), min_area_px)
            _draw(mask, height_mm, touched, (x, y), size, border_mm)
    return mask.view(bool)


def _height_noise(coarse: Array) -> float:
    """Sigma of the height at rest, from the pixels below it."""
    sample = _sample(coarse)
    below = -sample[sample < 0]
    return sigma_of(below) if len(below) else 0.0


def _slope_noise(slope: Array) -> float:
    """Sigma of each component of the slope at rest, from the calmest quarter."""
    return quantile(_sample(slope), 0.25) / _RAYLEIGH_QUARTILE


def _border(depth: Array, slope: Array) -> float:
    """Depth at a region's border, over the greatest, from (N,) relative depths and slopes."""
    band = np.clip((_BANDS * depth).astype(np.intp), 0, _BANDS - 1)
    usual = np.bincount(band, slope, _BANDS) / np.maximum(np.bincount(band, None, _BANDS), 1)
    usual[1:-1] += (usual[:-2] + usual[2:]) / 2
    steepest = 1 + int(np.argmax(usual[1 : _HIGHEST_BAND + 1]))
    return _BLUNT * (steepest + 0.5) / _BANDS


def _sample(image: Array) -> Array:
    step = max(1, int(np.sqrt(image.size / _NOISE_SAMPLES)))
    return np.asarray(image[::step, ::step].ravel())


def _without_specks(touched: Bool, min_area_px: float) -> Bool:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        touched.view(np.uint8), connectivity=8, ltype=cv2.CV_16U
    )
    keep = stats[:, cv2.CC_STAT_AREA] >= min_area_px
    keep[0] = False
    return np.asarray(keep[labels])


def _draw(
    mask: Array,
    height_mm: Array,
    touched: Bool,
    corner: tuple[int, int],
    coarse_size: tuple[int, ...],
    border_mm: float,
) -> None:
    """Set ``mask`` where the full image is above ``border_mm`` at and next to coarse pixels."""
    x, y = corner
    near = cv2.dilate(cv2.copyMakeBorder(touched.view(np.uint8), 1, 1, 1, 1, 0), np.ones((3, 3)))
    rows, columns = mask.shape
    across, down = columns / coarse_size[0], rows / coarse_size[1]
    left, right = (round(across * i) for i in (x - 1, x + 1 + touched.shape[1]))
    top, bottom = (round(down * i) for i in (y - 1, y + 1 + touched.shape[0]))
    near = repeated(np.asarray(near, np.uint8), (bottom - top, right - left))
    near = near[max(0, -top) : rows - top, max(0, -left) : columns - left]
    window = np.s_[max(0, top) : bottom, max(0, left) : right]
    mask[window] |= (height_mm[window] > border_mm).view(np.uint8) & near
