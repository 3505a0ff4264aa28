"""Sets heights to 0 where the gel surface is undeformed.

Slopes that are slightly wrong over a wide area integrate to heights that are far off. Where the
surface is undeformed its height is known to be 0, which reveals this error.
"""

from __future__ import annotations

from functools import lru_cache
from math import hypot
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.shrinking import coarse_size, shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, from_middle
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, THICKNESS_MM, Elastomer

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
# [gel thicknesses] Undeformed gel that is added around the view, so that periodic images of loads
# do not reach it: with half as much, peaks are up to 0.4 % lower
_PADDING_THICKNESSES = 2.0


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
    thickness_mm: float = THICKNESS_MM,
) -> None:
    """Set the undeformed surface to 0 in the height that was integrated from these slopes.

    Works in place: subtracts the plane of the undeformed surface, then the smooth error that its
    undeformed part reveals.

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
        Whether to subtract the smooth error; see :func:`estimate_error`.
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
    if levelled:
        undeformed = find_undeformed(cells_mm, across - plane.slope_x, down - plane.slope_y)
        thicknesses = cell_mm[0] / thickness_mm, cell_mm[1] / thickness_mm
        error_mm = estimate_error(cells_mm, undeformed, thicknesses)
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


def find_undeformed(cells_mm: Array, gx: Array, gy: Array) -> Bool:
    """Find the undeformed cells: they are calm, and low compared with the walls of objects.

    The top of an object may be calm, and shear may flatten its wall on one side. It is steep
    around most of its outline, though, so steep cells reach nearly to its height. Errors of the
    height are steep nowhere, however high they are.

    Parameters
    ----------
    cells_mm, gx, gy : (h, w)
        Height above the rest plane and slopes relative to it, means over cells.

    Returns
    -------
    (h, w) bool
    """
    calm: Bool = np.hypot(gx, gy) < _CALM_SLOPE
    if not calm.all():
        calm &= cells_mm < _RAISED_SHARE * cells_mm[~calm].max()
    return calm


def estimate_error(cells_mm: Array, undeformed: Bool, cell: tuple[float, float]) -> Float32:
    """Estimate the smooth error of heights from what no load can have caused.

    Gel bulges around a contact: where nothing touches it, its height is what the loads of the
    contacts cause in an elastic layer, and the rest is an error. The height without this error
    minimises the sum of squares of its slope errors plus that of ``rest / decay`` over the
    undeformed part: a screened Poisson equation, as in [1]_. So an error vanishes in the undeformed
    part, and continues smoothly below contacts, whose shape is kept. The undeformed part counts by
    its distance from what is deformed.

    Parameters
    ----------
    cells_mm : (h, w)
        Height above the rest plane, means over cells.
    undeformed : (h, w) bool
    cell : (float, float)
        Height and width of a cell in thicknesses of the gel.

    Returns
    -------
    (h, w) float32
        The error; subtract it from the height.

    References
    ----------
    .. [1] P. Bhat, B. Curless, M. Cohen and C. L. Zitnick, "Fourier analysis of the 2D screened
       Poisson equation for gradient domain problems", ECCV, 2008.
    """
    margins = _distance(undeformed) * (cell[1] / _MARGIN_THICKNESSES)
    weight = (cell[1] / _DECAY_THICKNESSES) ** 2 * -np.expm1(-margins * margins)
    error_mm = np.zeros(cells_mm.shape)
    for _ in range(2):  # [rounds] a third moves peaks by at most 0.2 %
        caused_mm = explain_by_loads(cells_mm - error_mm, ~undeformed, cell)
        error_mm = solve_screened(weight * (cells_mm - caused_mm), weight)
    return error_mm.astype(np.float32)


def explain_by_loads(cells_mm: Array, loaded: Bool, cell: tuple[float, float]) -> Float64:
    """Return the part of a height that pressure on some cells causes in an elastic layer.

    The pressure is that which would cause the whole height, as far as it pushes on these cells.
    Modulus and scale of the layer cancel out.

    Parameters
    ----------
    cells_mm : (h, w)
        Height, positive where pressed.
    loaded : (h, w) bool
        Cells that may be pressed.
    cell : (float, float)
        Height and width of a cell in thicknesses of the gel.

    Returns
    -------
    (h, w) float64
    """
    from scipy.fft import irfft2, rfft2

    compliance, size = _compliance(cells_mm.shape, cell)
    rows, columns = cells_mm.shape
    pressure = irfft2(rfft2(cells_mm, size) / compliance, size)[:rows, :columns]
    pushes = np.where(loaded, np.maximum(pressure, 0), 0)
    return np.asarray(irfft2(rfft2(pushes, size) * compliance, size)[:rows, :columns])


@lru_cache(maxsize=16)
def _compliance(
    shape: tuple[int, ...], cell: tuple[float, float]
) -> tuple[Float64, tuple[int, int]]:
    """Indentation per pressure of a padded grid's waves, as of ``rfft2``, and its size."""
    from scipy.fft import next_fast_len

    rows, columns = (
        next_fast_len(side + int(_PADDING_THICKNESSES / length), real=True)
        for side, length in zip(shape, cell, strict=True)
    )
    down = np.fft.fftfreq(rows, cell[0])[:, None]
    wave = 2 * np.pi * np.hypot(down, np.fft.rfftfreq(columns, cell[1]))
    layer = Elastomer(thickness_mm=1.0, shear_modulus_mpa=1.0, poisson_ratio=POISSON_RATIO)
    return layer.compliance(wave).normal, (rows, columns)


def _distance(undeformed: Bool) -> Float32:
    """Distance of each cell from the nearest that is not undeformed, in cells."""
    if undeformed.all():
        return np.full(undeformed.shape, np.inf, np.float32)
    return np.asarray(cv2.distanceTransform(undeformed.view(np.uint8), cv2.DIST_L2, 5), np.float32)


def solve_screened(source: Array, weight: Array) -> Float64:
    """Solve ``weight · z − Σ (neighbour − z) = source`` by conjugate gradients.

    It minimises the squared differences of neighbours plus ``weight · (z − source / weight)²``. The
    preconditioner is the exact solution for the mean weight, by cosine transforms. A banded
    factorisation takes as long, but starts the threads of LAPACK, which wait for each other for
    up to a second where other programs are busy.

    Parameters
    ----------
    source : (h, w) float64
    weight : (h, w) float64
        Not negative.

    Returns
    -------
    (h, w) float64
        z.
    """
    (down, of_down), (across, of_across) = (_cosines(n) for n in source.shape)
    # [weight] no division by zero
    inverse = 1 / (np.add.outer(of_down, of_across) + max(weight.mean(), 1e-9))

    def precondition(residual: Float64) -> Float64:
        # for so few cells, products of matrices take a third of the time of fast transforms
        return np.asarray(down.T @ ((down @ residual @ across.T) * inverse) @ across)

    z, residual = np.zeros(source.shape), source.astype(np.float64)
    direction = solved = precondition(residual)
    left = float(np.vdot(residual, solved))
    enough = 1e-3**2 * left  # [ratio] far below noise
    for _ in range(30):  # [rounds] contacts take 6 to 9
        if left <= enough:
            break
        neighbours = cv2.Laplacian(direction, -1, ksize=1, borderType=cv2.BORDER_REPLICATE)
        image = weight * direction - neighbours
        step = left / float(np.vdot(direction, image))
        z += step * direction
        residual -= step * image
        solved = precondition(residual)
        before, left = left, float(np.vdot(residual, solved))
        direction = solved + left / before * direction
    return z


@lru_cache(maxsize=16)
def _cosines(count: int) -> tuple[Float64, Float64]:
    """Orthonormal cosines, one a row, and their eigenvalues under ``Σ (z − neighbour)``."""
    wave = np.pi * np.arange(count) / count
    rows = np.sqrt(2 / count) * np.cos(np.outer(wave, np.arange(count) + 0.5))
    rows[0] = np.sqrt(1 / count)
    return rows, 2 - 2 * np.cos(wave)
