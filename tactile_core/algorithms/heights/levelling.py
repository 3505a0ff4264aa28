"""Sets heights to 0 where the gel surface is undeformed.

Slopes that are slightly wrong over a wide area integrate to heights that are far off. Where the
surface is undeformed its height is known to be 0, which reveals this error.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.shrinking import coarse_size, shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, from_middle
from tactile_core.algorithms.force.elastic_layer import THICKNESS_MM
from tactile_core.algorithms.heights.loads import explain_by_loads, gather, steps
from tactile_core.algorithms.poisson.screened import solve_screened

# [share of the greatest height] Lower cells may be undeformed: half-way between the gel and the top
# of an object; 0.3 to 0.5 give equal heights on recordings (ADR 47)
_RAISED_SHARE = 0.5
# [slope] Mean slope of a cell up to which it may be undeformed: 0.03 to 0.06 move peaks by at most
# 0.2 % of the depth (ADR 47)
_CALM_SLOPE = 0.04
# [gel thicknesses] At this distance from the nearest cell that is deformed, a cell has 63 % of its
# weight: closer, a gel that is not quite elastic would count as an error; 0.5 to 2 move peaks of
# virtual objects by at most 0.3 %
_MARGIN_THICKNESSES = 2.0
# [gel thicknesses] Length over which an error vanishes in the undeformed part; 0.3 to 2 move peaks
# of virtual objects by at most 0.4 %
_DECAY_THICKNESSES = 0.75
# [share of a slope] A shadow changes a slope by at most this much: on virtual rigs by 7 to 15 % in
# the mean of the gel around a ball. Without a limit, heights are a fifth too low where a gel hugs
# an object more closely than in theory; with 0.1, virtual balls are 0.5 % higher, with 0.2 lower
SHADOW_SHARE = 0.15


class RestPlane(NamedTuple):
    """Plane of the rest surface.

    Attributes
    ----------
    level_mm : float
        Height at the image centre.
    slope_x, slope_y : float
        Tilt to the right and downwards, dimensionless.
    """

    level_mm: float
    slope_x: float
    slope_y: float

    def heights_mm(self, shape: tuple[int, int], cell_mm: tuple[float, float]) -> Float32:
        """Heights at the centres of (h, w) cells of this height and width that tile the image."""
        down, across = (from_middle(n) * mm for n, mm in zip(shape, cell_mm, strict=True))
        levels = self.level_mm + self.slope_y * down
        return np.add.outer(levels, self.slope_x * across, dtype=np.float32)


def set_to_rest(
    height_mm: Float32,
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    drift_slope: float = 0.05,
    levelled: bool = True,
    shadow_share: float = SHADOW_SHARE,
    thickness_mm: float = THICKNESS_MM,
) -> None:
    """Set the undeformed surface to 0 in the height that was integrated from these slopes.

    Works in place: subtracts the plane of the undeformed surface, then what no load on the rest can
    have caused, in so far as it is smooth.

    Parameters
    ----------
    height_mm : (H, W) float32
        Height of any level.
    gx, gy : (H, W)
        ∂z/∂x and ∂z/∂y, dimensionless.
    mm_per_px : float
        Scale of the image.
    drift_slope : float
        Largest tilt that counts as drift; see :func:`fit_rest_plane`.
    levelled : bool
        Whether to subtract the smooth error; see
        :func:`tactile_core.algorithms.heights.loads.explain_by_loads`.
    shadow_share : float
        Largest share by which an object's shadow changes the slopes beside it.
    thickness_mm : float
        Thickness of the gel.
    """
    rows, columns = height_mm.shape
    # [cells] Small enough to see the gel between the balls of a grid; with 300 their heights fade
    # by a fifth while the lights drift (ADR 47)
    size = coarse_size(rows, columns, 1200)
    cells_mm, across, down = (shrink_image(plane, size) for plane in (height_mm, gx, gy))
    cell_mm = rows / size[1] * mm_per_px, columns / size[0] * mm_per_px
    plane = fit_rest_plane(cells_mm, across, down, cell_mm=cell_mm, drift_slope=drift_slope)
    cells_mm = cells_mm - plane.heights_mm(cells_mm.shape, cell_mm)
    height_mm -= plane.heights_mm(height_mm.shape, (mm_per_px, mm_per_px))
    slope = np.hypot(across - plane.slope_x, down - plane.slope_y)
    if levelled and not covers_view(cells_mm, slope):
        cell = cell_mm[0] / thickness_mm, cell_mm[1] / thickness_mm
        error_mm = estimate_error(cells_mm, slope, cell, shadow_share)
        height_mm -= cv2.resize(error_mm, (columns, rows), interpolation=cv2.INTER_CUBIC)


def fit_rest_plane(
    cells_mm: Array, gx: Array, gy: Array, *, cell_mm: tuple[float, float], drift_slope: float
) -> RestPlane:
    """Fit a plane to the undeformed gel surface out of contact.

    A change of the light biases all slopes in the same direction and tilts the height map as a
    whole. This tilt, the median slope, counts as drift only if it is below ``drift_slope``, and
    some cells have this slope to within ``drift_slope``. Otherwise most of the image is not
    undeformed, and only the level of its flatter half is estimated.

    An object raises the surface, so the gel is the lowest level of the calm cells, even below an
    object that covers 60 % of them. Next to an object the surface bulges down by at most a third
    of its height; the bulge counts as gel, too. A press that covers the whole image leaves no
    undeformed surface; its shape is kept, unless it is a mere tilt below ``drift_slope``, which is
    indistinguishable from drift.

    Parameters
    ----------
    cells_mm, gx, gy : (h, w)
        Height, and the slopes that it was integrated from: means over cells that tile the image.
    cell_mm : (float, float)
        Height and width of a cell.
    drift_slope : float
        Largest tilt that counts as drift; 0 estimates the level alone.
    """
    tilt = quantile(gx.ravel(), 0.5), quantile(gy.ravel(), 0.5)
    calm = np.hypot(gx - tilt[0], gy - tilt[1]) < drift_slope
    drifts = hypot(*tilt) < drift_slope and bool(calm.any())
    if not drifts:
        tilt, slope = (0.0, 0.0), np.hypot(gx, gy)
        calm = slope <= quantile(slope.ravel(), 0.5)
    above_mm = cells_mm - RestPlane(0.0, *tilt).heights_mm(cells_mm.shape, cell_mm)
    # [share] The median of the gel if objects cover 60 % of the calm cells
    low_mm = quantile(above_mm[calm], 0.2)
    gel = calm & (above_mm <= low_mm + _RAISED_SHARE * (above_mm.max() - low_mm))
    if not drifts:
        return RestPlane(float(above_mm[gel].mean()), 0.0, 0.0)
    y, x = (from_middle(n) * mm for n, mm in zip(gel.shape, cell_mm, strict=True))
    row, column = gel.nonzero()
    terms = np.stack([np.ones(len(row)), x[column], y[row], cells_mm[gel]])
    # normal equations take a quarter of the time; gel along one line determines no plane
    products = terms @ terms.T
    return RestPlane(*np.linalg.lstsq(products[:3, :3], products[:3, 3], rcond=None)[0].tolist())


def covers_view(cells_mm: Array, slope: Array) -> bool:
    """Whether an object covers the view, so that the rest plane is its own.

    Then steep cells are the walls of its grooves, and lie below the plane. The walls of an object
    on undeformed gel lie above it.

    Parameters
    ----------
    cells_mm, slope : (h, w)
        Height above the rest plane and slope relative to it, means over cells.
    """
    return bool(cells_mm[slope >= _CALM_SLOPE].sum() < 0)


def find_undeformed(cells_mm: Array, slope: Array) -> Bool:
    """Find the undeformed cells: they are calm, and low compared with the nearest wall.

    The top of an object may be calm, and shear may flatten its wall on one side. It is steep
    around most of its outline, though, so the steep cells of its wall reach nearly to its height.
    Errors of the height are steep nowhere, however high they are.

    Parameters
    ----------
    cells_mm, slope : (h, w)
        Height above the rest plane and slope relative to it, means over cells.

    Returns
    -------
    (h, w) bool
    """
    calm: Bool = slope < _CALM_SLOPE
    if calm.all():
        return calm
    # a wall and the cells that are nearest to it have the same number
    wall = cv2.distanceTransformWithLabels(
        calm.view(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP
    )[1].astype(np.intp)
    tops_mm = np.full(wall.max() + 1, -np.inf)
    np.maximum.at(tops_mm, wall[~calm], cells_mm[~calm])
    low: Bool = cells_mm < _RAISED_SHARE * tops_mm[wall]
    return calm & low


def estimate_error(
    cells_mm: Array, slope: Array, cell: tuple[float, float], shadow_share: float
) -> Float32:
    """Estimate the smooth error of heights from what no load can have caused.

    Loads on the contacts explain the height in between: where nothing touches the gel, and where
    its measured slope may be that of a shadow. What they leave unexplained there is an error. The
    height without this error minimises the sum of squares of its slope errors plus that of
    ``rest / decay`` over the undeformed part: a screened Poisson equation, as in [1]_. So an error
    vanishes in the undeformed part, and continues smoothly below contacts, whose shape is kept. The
    undeformed part counts by its distance from what is deformed.

    Parameters
    ----------
    cells_mm, slope : (h, w)
        Height above the rest plane and slope relative to it, means over cells.
    cell : (float, float)
        Height and width of a cell in thicknesses of the gel.
    shadow_share : float
        Largest share by which a shadow changes a slope.

    Returns
    -------
    (h, w) float32
        The error; subtract it from the height.

    References
    ----------
    .. [1] P. Bhat, B. Curless, M. Cohen and C. L. Zitnick, "Fourier analysis of the 2D screened
       Poisson equation for gradient domain problems", ECCV, 2008.
    """
    undeformed = find_undeformed(cells_mm, slope)
    explained = explain_by_loads(cells_mm, slope, ~undeformed, cell)
    margins = _distance(undeformed) * (cell[1] / _MARGIN_THICKNESSES)
    weight = (cell[1] / _DECAY_THICKNESSES) ** 2 * -np.expm1(-margins * margins)
    rest_mm = cells_mm - explained.cells_mm
    doubt_mm = [
        (1 - believed) * np.clip(wrong, -abs(shadow_share * step), abs(shadow_share * step))
        for believed, wrong, step in zip(
            explained.weights, steps(rest_mm), steps(cells_mm), strict=True
        )
    ]
    source = weight * rest_mm + gather((doubt_mm[0], doubt_mm[1]))
    return solve_screened(source, weight).astype(np.float32)


def _distance(undeformed: Bool) -> Float32:
    """Distance of each cell from the nearest that is not undeformed, in cells."""
    if undeformed.all():
        return np.full(undeformed.shape, np.inf, np.float32)
    return np.asarray(cv2.distanceTransform(undeformed.view(np.uint8), cv2.DIST_L2, 5), np.float32)
