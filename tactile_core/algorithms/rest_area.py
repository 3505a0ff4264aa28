"""Undeformed part of the gel surface: where it is, and the error of the height there.

Slopes that are slightly wrong over a wide area integrate to heights that are far off. Where the
surface is undeformed, the height is known to be 0, which reveals this error.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, UInt8
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.poisson.screened import solve_screened
from tactile_core.algorithms.slope_grid import coarse_size


class REST_AREA:
    """Parameters of the undeformed area that no option sets."""

    # [count] Approximate number of cells over which slopes are averaged to find the undeformed
    # area. Source: by hand, 1200, 4800 and 19200 give equal heights (ADR 47).
    cells = 1200
    # [ratio] These cells across and down share one value of the error, which is much smoother.
    # Source: heights differ by less than 1 µm from those of an error in each cell (ADR 86).
    cells_per_error = 2
    # [slope] Mean slope of a cell up to which it may be undeformed. Source: by hand, 0.02 to 0.08
    # give equal heights (ADR 47).
    calm_slope = 0.04
    # [gel thicknesses] At this distance from the nearest cell that is not calm, a cell has 63 %
    # of its weight, since the gel bulges around a contact. Source: by hand, on virtual presses
    # and the recordings of ADR 47, which are therefore no independent test of it.
    margin_thicknesses = 2.0
    # [gel thicknesses] Length over which an error vanishes in the undeformed part. Source: by
    # hand, like ``margin_thicknesses``, between low heights far from contacts (short) and the
    # true bulge next to them (long).
    decay_thicknesses = 0.75
    # [share of the greatest height] Cells raised by this have half the weight of others, and
    # higher ones hardly any. Where they are calm, they are parts of their own. Source: the bulge
    # next to an object, by the mechanics of the virtual gel at most a third.
    raised_share = 0.3
    # [mm] Lower bound of the height of a raised cell, for images without a contact. Source: by
    # hand, above the least depth of a contact.
    least_raised_mm = 0.05
    # [share of the image] A calm part of this size at the level of the gel is undeformed,
    # whatever its rim.
    main_share = 0.3
    # [share of the rim] A raised calm part with a larger share of steep rim is the top of an
    # object. Source: an object is steep around most of its outline, an error of the height
    # nowhere; half is between.
    steep_share = 0.5
    # [ratio] Weight of the height as integrated, relative to that of the undeformed surface. It
    # only matters far from any undeformed surface. Source: by hand, small enough to have no
    # effect within an image.
    held = 1e-3
    # [count] Searches for raised cells, since the correction changes the heights. Source: by
    # hand, a third round changes nothing.
    rounds = 2
    # [ratio] Factor by which the correction is enlarged by cubic interpolation, before linear
    # interpolation, which is faster.
    smooth_factor = 4


def height_error(
    height_mm: Array,
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    tilt: tuple[float, float] = (0.0, 0.0),
    thickness_mm: float = THICKNESS_MM,
) -> Float32:
    """Estimate the smooth error of a height map from its undeformed part.

    The height without this error minimises the sum of squares of its slope errors plus that of
    ``height / decay`` over the undeformed part: a screened Poisson equation, as in [1]_. So an
    error vanishes inside the undeformed part, and continues smoothly below contacts, whose shape is
    kept. The gel around a contact bulges, by physics and not by error; so the undeformed part
    counts by its distance from what is not calm. Both lengths scale with the thickness of the gel.

    Parameters
    ----------
    height_mm : (H, W) float32
        Height above the rest surface, integrated from the slopes.
    gx, gy : (H, W) float32
        The slopes.
    mm_per_px : float
        Scale of the image.
    tilt : (float, float)
        Slopes of a plane that was subtracted from the height.
    thickness_mm : float
        Thickness of the gel.

    Returns
    -------
    (H, W) float32
        The error; subtract it from the height.

    References
    ----------
    .. [1] P. Bhat, B. Curless, M. Cohen and C. L. Zitnick, "Fourier analysis of the 2D screened
       Poisson equation for gradient domain problems", ECCV, 2008.
    """
    rows, columns = height_mm.shape
    size, halves = _sizes(rows, columns)
    cell = columns / halves[0] * mm_per_px / thickness_mm
    margin = REST_AREA.margin_thicknesses / cell
    stiffness = (columns / size[0] * mm_per_px / thickness_mm / REST_AREA.decay_thicknesses) ** 2
    coarse, across, down = (shrink_image(plane, halves) for plane in (height_mm, gx, gy))
    undeformed = rest_area(coarse, across - tilt[0], down - tilt[1])
    cells_mm = shrink_image(coarse, size)
    trust, error = (
        stiffness * shrink_image(_distant(undeformed, margin), size),
        np.zeros(size[::-1]),
    )
    for _ in range(REST_AREA.rounds):
        left_mm = cells_mm - error
        weight = trust / (1 + (np.maximum(left_mm, 0) / _raised_mm(left_mm)) ** 4)
        error = solve_screened(weight * cells_mm, weight + stiffness * REST_AREA.held)
    return _enlarge_cells(error.astype(np.float32), (rows, columns))


@lru_cache(maxsize=16)
def _sizes(rows: int, columns: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Width and height of the grid of the error, and of that of the undeformed area, in cells."""
    times = REST_AREA.cells_per_error
    width, height = coarse_size(rows, columns, REST_AREA.cells // times**2)
    if times * width > columns or times * height > rows:
        return (width, height), (width, height)
    return (width, height), (times * width, times * height)


def rest_area(height_mm: Array, gx: Array, gy: Array) -> Bool:
    """Find the undeformed cells of a coarse height map.

    An undeformed part is calm, and the surface rises at its rim, where objects touch it. Flat tops
    of objects are calm, too, but the surface descends from them. Where shear has flattened the wall
    of an object, its top and the gel around it are one calm region; so raised cells are parts of
    their own. They are errors of the height unless most of their rim is steep.

    Parameters
    ----------
    height_mm, gx, gy : (H, W)
        Means over cells; 0 at the rest surface.

    Returns
    -------
    (H, W) bool
    """
    calm = (gx * gx + gy * gy < REST_AREA.calm_slope**2).view(np.uint8)
    raised_mm = _raised_mm(height_mm)
    part, first_raised, count = _parts(calm, height_mm, float(height_mm.max()))
    pairs = []
    for slopes, labels in ((gx, part), (gy.T, part.T)):
        left, right = labels[:, :-1], labels[:, 1:]
        rim = left != right
        between, left, right = (slopes[:, :-1] + slopes[:, 1:])[rim], left[rim], right[rim]
        pairs += [(left, right, between), (right, left, -between)]
    here, there, outwards = (np.concatenate(each) for each in zip(*pairs, strict=True))
    rise, rim_lengths = np.bincount(here, outwards, count), np.bincount(here, None, count)
    steep = np.bincount(here, there == 0, count) > REST_AREA.steep_share * rim_lengths
    flat = part.ravel()
    sizes = np.bincount(flat, None, count)
    levels = np.bincount(flat, height_mm.ravel(), count) / np.maximum(sizes, 1)
    main = (levels < raised_mm) & (sizes > REST_AREA.main_share * part.size)
    undeformed = (rise >= 0) | main
    undeformed[first_raised:] = ~steep[first_raised:]
    undeformed[0] = False
    return np.asarray(undeformed[part])


def _parts(calm: UInt8, height_mm: Array, highest_mm: float) -> tuple[NDArray[np.int32], int, int]:
    """Number the calm parts of an image: those that are raised come last.

    Raised cells are higher than a share of the greatest height, however low that is: without a
    contact, they are errors, and none of their rim is steep.

    Returns
    -------
    part : (H, W) int32
        0 where it is not calm.
    first_raised, count : int
        Number of the first part that is raised, and one more than that of the last.
    """
    high = calm & (height_mm > REST_AREA.raised_share * highest_mm)
    low_count, part = cv2.connectedComponents(calm - high, connectivity=4, ltype=cv2.CV_32S)
    if not high.any():
        return np.asarray(part, np.int32), low_count, low_count
    high_count, tops = cv2.connectedComponents(high, connectivity=4, ltype=cv2.CV_32S)
    part = np.where(tops, tops + (low_count - 1), part)
    return np.asarray(part, np.int32), low_count, low_count + high_count - 1


def _raised_mm(height_mm: Array) -> float:
    """Height from which a cell is raised."""
    return max(REST_AREA.raised_share * float(height_mm.max()), REST_AREA.least_raised_mm)


def _distant(undeformed: Bool, margin: float) -> Array:
    """Weight of each undeformed cell, by its distance from other cells; ``margin`` in cells."""
    near = _distance(undeformed) * (1 / margin)
    near *= -near
    return np.asarray(-np.expm1(near))


def _distance(undeformed: Bool) -> Float32:
    """Distance of each cell from the nearest that is not undeformed, in cells."""
    if undeformed.all():
        return np.full(undeformed.shape, np.inf, np.float32)
    return np.asarray(cv2.distanceTransform(undeformed.view(np.uint8), cv2.DIST_L2, 5), np.float32)


def _enlarge_cells(cells: Float32, shape: tuple[int, int]) -> Float32:
    """Enlarge (h, w) cells that tile an image to (H, W), smoothly."""
    down, across = (_enlarging(*sides) for sides in zip(cells.shape, shape, strict=True))
    return np.asarray(down @ (cells @ across.T))


@lru_cache(maxsize=16)
def _enlarging(cells: int, pixels: int) -> Float32:
    """Matrix that enlarges a line of cells to one of pixels, (pixels, cells).

    By cubic interpolation to a few times as many, and linear interpolation from there.
    """
    wide = cells * REST_AREA.smooth_factor
    size = (min(wide, pixels), cells)
    lines = cv2.resize(np.eye(cells, dtype=np.float32), size, interpolation=cv2.INTER_CUBIC)
    if wide < pixels:
        lines = cv2.resize(lines, (pixels, cells), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(lines.T, np.float32)
