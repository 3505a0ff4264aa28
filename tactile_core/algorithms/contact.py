"""The contact area, and its rim."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import quantile, sigma_of
from tactile_core.algorithms.arrays.shrinking import repeat_pixels, shrink_image, steepness
from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, Elastomer
from tactile_core.errors import InputError

_DETECTION_SIGMAS = 5.0  # [noise sigmas] A contact is deeper and steeper than this somewhere
_BANDS = 20  # [count] Bands of relative depth in which slopes are averaged (ADR 24)
# [ratio] Depth of the border over that of the steepest contour, which smoothing moves inwards:
# chosen on virtual balls, cylinders, flat ends and cones (table of ADR 24)
_BORDER_RATIO = 0.8


def contact_mask(
    height_mm: Array,
    *,
    mm_per_px: float,
    step_px: int = 1,
    min_indentation_mm: float = 0.03,
    border_fraction: float | None = None,
    min_slope: float = 0.1,
    min_area_mm2: float = 0.05,
) -> Bool:
    """Segment the contact area.

    A raised region is a contact if it is

    - deep: somewhere indented by ``min_indentation_mm`` and by 5 times the noise of the height;
    - steep: somewhere sloped by ``min_slope`` and by 5 times the noise of the slope. A contact has
      a flank; drift may reach any height, but has none;
    - large: at least ``min_area_mm2``, and so is its flank, so that specks are left out.

    The noise comes from the map itself: that of the height from the pixels below the rest surface,
    where there is no contact, up to a twentieth of the greatest height; that of the slope from its
    lower quartile. Without the noise of the slope, 21 % of undeformed surfaces that drift have a
    contact, instead of less than 3 %.

    The surface around a contact is indented, too, so the contact does not end where the indentation
    does. It ends where the surface leaves the object and the slope decreases: at half the depth for
    a ball with a small contact (Hertz [1]_), and lower for contacts that are wide compared with the
    thickness of the gel. So the border follows from the contour of the region that is steepest on
    average. The wall of a flat-ended object is steep, so its border barely depends on the fraction.
    Parts less deep than the border of their own region are missed, such as the high side of a
    strongly tilted plate.

    Parameters
    ----------
    height_mm : (h, w) float32
        Height above the rest surface, positive where pressed.
    mm_per_px : float
        Scale of the image.
    step_px : int
        Side of a cell of the height map; 1 for pixels.
    min_indentation_mm : float
        Least depth of a contact, in mm.
    border_fraction : float, optional
        Depth at the border over the greatest depth of the region. Default: from the slopes.
    min_slope : float
        Least slope of the flank of a contact, dimensionless.
    min_area_mm2 : float
        Least area of a contact, in mm².

    Returns
    -------
    (h · step_px, w · step_px) bool
        All False when nothing touches. The border lies where the interpolated height has the depth
        of the border.

    Raises
    ------
    InputError
        The height map is not 2-D or is empty.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985,
       chapter 4: under Hertz's pressure the depth at the edge is half of that at the centre.
    """
    if height_mm.ndim != 2 or 0 in height_mm.shape:
        raise InputError(f"a height map is (H, W); this one is {height_mm.shape}")
    height_mm = np.asarray(height_mm, np.float32)
    rows, columns = (side * step_px for side in height_mm.shape)
    mask = np.zeros((rows, columns), np.uint8)
    shrink = max(step_px, round(math.sqrt(mask.size / (160 * 120))))  # [px] enough for regions
    size = max(1, columns // shrink), max(1, rows // shrink)
    coarse = shrink_image(height_mm, size)
    highest_mm = float(coarse.max())
    # [share of the greatest height] The surface beside a wide contact bulges evenly, by up to a
    # third of the depth; this is not noise
    noise_mm = min(_height_noise(coarse), 0.05 * highest_mm)
    low_mm = max(min_indentation_mm, 2.5 * noise_mm)  # [noise sigmas] higher than this everywhere
    detectable_mm = max(min_indentation_mm, _DETECTION_SIGMAS * noise_mm)
    if highest_mm <= detectable_mm:
        return mask.view(bool)
    slope = steepness(coarse, shrink * mm_per_px)
    steep = slope > max(min_slope, _DETECTION_SIGMAS * _slope_noise(slope))
    min_area_px = min_area_mm2 / (shrink * mm_per_px) ** 2
    for window, region in _parts(coarse > low_mm, min_area_px):
        heights_mm = coarse[window][region]
        peak_mm = float(heights_mm.max())
        flank = np.count_nonzero(region & steep[window])
        if peak_mm > detectable_mm and flank >= max(1, min_area_px):
            share = border_fraction
            if share is None:
                share = _border(heights_mm / peak_mm, slope[window][region])
            border_mm = max(low_mm, share * peak_mm)
            corner = window[1].start, window[0].start
            for inner, touched in _parts(region & (coarse[window] > border_mm), min_area_px):
                at = corner[0] + inner[1].start, corner[1] + inner[0].start
                _draw(mask, height_mm, step_px, touched, at, size, border_mm)
    return mask.view(bool)


_SQUARE = np.ones((3, 3), np.uint8)  # Neighbourhood of a pixel


def _height_noise(coarse: Array) -> float:
    """Standard deviation of the height of the undeformed surface, from the pixels below 0."""
    sample = _sample(coarse)
    below = sample[sample < 0]
    return sigma_of(below) if len(below) else 0.0


def _slope_noise(slope: Array) -> float:
    """Standard deviation of each component of the undeformed slope, from the lower quartile."""
    # [noise sigmas] the lower quartile of a Rayleigh distribution: √(−2 ln 0.75)
    return quantile(_sample(slope), 0.25) / 0.7585


def _border(depth: Array, slope: Array) -> float:
    """Relative depth at the border of a region, from (N,) relative depths and slopes."""
    band = np.minimum((_BANDS * depth).astype(np.intp), _BANDS - 1)
    mean = np.bincount(band, slope, _BANDS) / np.maximum(np.bincount(band, None, _BANDS), 1)
    mean[1:-1] += (mean[:-2] + mean[2:]) / 2
    steepest = 1 + int(np.argmax(mean[1:12]))  # [bands] the steepest contour is lower
    low, top, high = mean[steepest - 1 : steepest + 2].tolist()
    # between bands by a parabola, so that the border does not jump by a band with the noise
    beyond = (low - high) / (2 * (low - 2 * top + high)) if low + high < 2 * top else 0.0
    return _BORDER_RATIO * (steepest + 0.5 + min(max(beyond, -0.5), 0.5)) / _BANDS


def _sample(image: Array) -> Array:
    step = max(1, int(math.sqrt(image.size / 4000)))  # [pixels] enough for the noise
    return np.asarray(image[::step, ::step].ravel())


def _parts(mask: Bool, min_area_px: float) -> Iterator[tuple[tuple[slice, slice], Bool]]:
    """Connected parts of a mask that are large enough: the window (rows, columns) of each, and it.

    Other parts may reach into the window.
    """
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        mask.view(np.uint8), connectivity=8, ltype=cv2.CV_16U
    )
    for label in np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] >= min_area_px) + 1:
        left, top, width, height = stats[label, : cv2.CC_STAT_AREA].tolist()
        window = slice(top, top + height), slice(left, left + width)
        yield window, labels[window] == label


def _draw(
    mask: Array,
    height_mm: Array,
    step_px: int,
    touched: Bool,
    corner: tuple[int, int],
    coarse_size: tuple[int, ...],
    border_mm: float,
) -> None:
    """Set ``mask`` where the height is above ``border_mm``, at and next to touched pixels."""
    x, y = corner
    near = cv2.dilate(cv2.copyMakeBorder(touched.view(np.uint8), 1, 1, 1, 1, 0), _SQUARE)
    rows, columns = mask.shape
    across, down = columns / coarse_size[0], rows / coarse_size[1]
    left, right = (round(across * i) for i in (x - 1, x + 1 + touched.shape[1]))
    top, bottom = (round(down * i) for i in (y - 1, y + 1 + touched.shape[0]))
    near = repeat_pixels(np.asarray(near, np.uint8), (bottom - top, right - left))
    near = near[max(0, -top) : rows - top, max(0, -left) : columns - left]
    window = slice(max(0, top), min(rows, bottom)), slice(max(0, left), min(columns, right))
    mask[window] |= (_pixels(height_mm, step_px, window) > border_mm).view(np.uint8) & near


def _pixels(cells: Array, step_px: int, window: tuple[slice, slice]) -> Array:
    """Return the pixels of a window (rows, columns), interpolated from the cells around it."""
    if step_px == 1:
        return cells[window]
    around = [slice(max(0, s.start // step_px - 1), s.stop // step_px + 2) for s in window]
    part = cells[tuple(around)]
    size = part.shape[1] * step_px, part.shape[0] * step_px
    pixels = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_LINEAR))
    rows, columns = (
        slice(s.start - a.start * step_px, s.stop - a.start * step_px)
        for s, a in zip(window, around, strict=True)
    )
    return pixels[rows, columns]


# [logarithm of the radius over the thickness] Spacing at which the share is calculated; it is
# interpolated between: the error is below 1e-4
_NODE = 0.02


def rim_share(
    contact_radius_mm: float, thickness_mm: float, poisson_ratio: float = POISSON_RATIO
) -> float:
    """Height of the rim of a contact, over the height of its centre above the rim.

    Both follow from Hertz's pressure √(1 − r²/a²) [1]_ on an elastic layer bonded to a plate. The
    ratio is 1 on a half-space and decreases with the thickness of the layer. It is 0 where the
    layer is so thin that this pressure would make it bulge around the contact. On virtual sensors
    (balls of 4 and 8 mm, up to 0.8 mm deep in 2 mm of gel) the error is at most 0.1.

    Parameters
    ----------
    contact_radius_mm, thickness_mm : float
        Radius a of the contact, and thickness of the gel.
    poisson_ratio : float
        Of the elastomer.

    Returns
    -------
    float
        0 to 1.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985, chapter 4.
    """
    # it depends on the ratio of both alone
    node = float(np.log(contact_radius_mm / thickness_mm)) / _NODE
    low = int(np.floor(node))
    share = node - low
    return (1 - share) * _share_at(low, poisson_ratio) + share * _share_at(low + 1, poisson_ratio)


@cache
def _share_at(node: int, poisson_ratio: float) -> float:
    """Share at a node, for a layer of unit thickness."""
    from scipy.special import j0

    # [inverse contact radii] up to 60, where the spectrum of the pressure has decayed
    ka = (np.arange(6000) + 0.5) / 100
    pressure = (np.sin(ka) - ka * np.cos(ka)) / ka**3
    layer = Elastomer(1.0, 1.0, poisson_ratio)
    waves = pressure * layer.compliance(ka / np.exp(_NODE * node)).normal * ka
    top, rim = waves.sum(), (waves * j0(ka)).sum()
    return float(np.clip(rim / (top - rim), 0, 1))
