"""Levels heights by the surface at rest."""

from __future__ import annotations

from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import narrowest, quantile, sigma_of
from tactile_core.algorithms.arrays.types import Array, Float32, Float64, from_middle
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.rest_area import height_error


class REST:
    """Parameters of the search for the rest surface. What a user may set is the largest tilt."""

    samples = 1200  # [count] Approximate number of pixels that are used
    rounds = 3  # [count] Reweightings of the biweight regression
    # [standard deviations] Residuals beyond it have no weight. Source: by hand, near the 4.685
    # that gives the biweight an efficiency of 95 % on normal residuals.
    biweight_sigmas = 4.5
    # [share of the samples] Samples near the median slope that a tilt takes to count as drift.
    least_calm_share = 0.3
    # [share of the range of heights] The surface next to an object bulges down by less than this.
    # Source: by hand, by the mechanics of the virtual gel it is at most a third.
    bulge_ratio = 0.3
    # [share of the calm samples] With this many samples below the bulge, they are the rest
    # surface.
    least_below_share = 0.2
    least_sigma_mm = 1e-6  # [mm] Lower bound of the residual scale, against division by zero
    # [standard deviations] Length of the shortest interval that holds half of a normal
    # distribution. Source: the interquartile range of the normal distribution, 2 × 0.6745.
    half_width_sigmas = 1.349
    ridge = 1e-12  # [per sample] Makes an image of one row or one column solvable


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

    def removed_from(self, height_mm: Array, mm_per_px: float, out: Array | None = None) -> Array:
        """Return the height above this plane.

        Parameters
        ----------
        height_mm : (H, W)
        mm_per_px : float
            Scale of the image.
        out : (H, W), optional
            Memory for the result; ``height_mm`` itself is allowed.

        Returns
        -------
        (H, W), same dtype
        """
        rows, columns = height_mm.shape
        down = self.slope_y * mm_per_px * from_middle(rows)
        across = self.slope_x * mm_per_px * from_middle(columns)
        levels = (self.level_mm + down[:, None]).astype(height_mm.dtype)
        above = np.subtract(height_mm, levels, out=out)
        if self.slope_x:
            above -= across.astype(height_mm.dtype)
        return np.asarray(above)


def rest_plane(
    height_mm: Array,
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    drift_slope: float = 0.05,
) -> RestPlane:
    """Estimate the undeformed gel surface out of contact.

    A change of the light biases all slopes in the same direction and tilts the height map as a
    whole. So a plane is fitted robustly. It starts from the median slope and the mode of the
    heights of the flatter half of the pixels; Tukey's biweight [1]_ then rejects outliers, such as
    contacts. The tilt counts as drift only if it is below ``drift_slope`` and at least 30 % of the
    pixels have this slope to within ``drift_slope``. Otherwise most of the image is not
    undeformed, and only the level is estimated: the mode of the flatter half. The mode is the mean
    of the shortest half (the shorth [2]_).

    An object raises the surface, and next to it the surface bulges down by at most a third of that.
    So if a fifth of the pixels are still further below the mode, the mode is the top of a flat
    object, and the rest surface is the lower level. The estimate is robust to contacts on up to
    about 60 % of the image. A press that covers the whole image leaves no undeformed surface; its
    shape is kept, unless it is a mere tilt below ``drift_slope``, which is indistinguishable from
    drift.

    Parameters
    ----------
    height_mm, gx, gy : (H, W)
        The height, and the slopes that it was integrated from.
    mm_per_px : float
        Scale of the image.
    drift_slope : float
        Largest tilt that counts as drift; 0 estimates the level alone.

    References
    ----------
    .. [1] A. E. Beaton and J. W. Tukey, "The fitting of power series, meaning polynomials,
       illustrated on band-spectroscopic data", Technometrics 16(2), 1974.
    .. [2] D. F. Andrews et al., "Robust Estimates of Location: Survey and Advances", Princeton
       University Press, 1972.
    """
    rows, columns = height_mm.shape
    step = max(1, int(np.sqrt(rows * columns / REST.samples)))
    z, p, q = (a[step // 2 :: step, step // 2 :: step].ravel() for a in (height_mm, gx, gy))
    tilt = quantile(p, 0.5), quantile(q, 0.5)
    deviation = _squares(p - tilt[0], q - tilt[1])
    (calm,) = (deviation < drift_slope**2).nonzero()
    if len(calm) < REST.least_calm_share * len(z) or hypot(*tilt) > drift_slope:
        slope = _squares(p, q)
        return RestPlane(_mode(z[slope <= quantile(slope, 0.5)])[0], 0.0, 0.0)
    terms = _terms(rows, columns, step, mm_per_px)
    levelled = (z - np.dot((0.0, *tilt), terms)).astype(z.dtype)
    apart = REST.bulge_ratio * float(levelled.max() - levelled.min())
    flat = levelled[deviation <= quantile(deviation, 0.5)]
    level, spread = _lower_level(flat, levelled.take(calm), apart)
    start = level, *tilt
    plane = _robust_plane(terms.take(calm, axis=1), z.take(calm), start, spread)
    if hypot(plane[1], plane[2]) > drift_slope:
        return RestPlane(level, *tilt)
    return RestPlane(*plane)


def _squares(x: Array, y: Array) -> Array:
    return np.asarray(x * x + y * y)


@lru_cache(maxsize=16)
def _terms(rows: int, columns: int, step: int, mm_per_px: float) -> Float64:
    """1, x and y of every pixel that is used, from the middle of the image, (3, N)."""
    y, x = (from_middle(side)[step // 2 :: step] * mm_per_px for side in (rows, columns))
    return np.stack([np.ones(len(x) * len(y)), np.tile(x, len(y)), np.repeat(y, len(x))])


def _mode(values: Array) -> tuple[float, float]:
    """Mean of the shortest interval that holds half of the values, and a sigma from its length."""
    ordered = np.sort(values)
    half = (len(ordered) + 1) // 2
    first, length = narrowest(ordered, half)
    spread = float(length) / REST.half_width_sigmas
    return float(ordered[first : first + half].sum()) / half, spread


def _lower_level(flat: Array, calm: Array, apart: float) -> tuple[float, float]:
    """Mode of the flat values, or of the calm ones that are ``apart`` below it if enough are."""
    level, spread = _mode(flat)
    below = calm[calm < level - apart]
    if len(below) >= REST.least_below_share * len(calm):
        level, spread = _mode(below)
    return level, min(spread, apart / REST.biweight_sigmas)


def _robust_plane(terms: Array, z: Array, start: tuple[float, ...], sigma: float) -> list[float]:
    """Tukey's biweight regression of (N,) heights on (3, N) terms, from a good start."""
    plane = np.array(start)
    residual = z - plane @ terms
    for last in range(REST.rounds - 1, -1, -1):
        near = residual * (1 / (REST.biweight_sigmas * max(sigma, REST.least_sigma_mm)))
        near *= near
        weights = 1 - np.minimum(near, 1)
        weights *= weights
        weighted = terms * weights
        normal = weighted @ terms.T + REST.ridge * len(z) * np.eye(3)
        plane += np.linalg.solve(normal, weighted @ residual)
        if last:
            residual = z - plane @ terms
            sigma = sigma_of(residual[near < 1].astype(z.dtype))
    found: list[float] = plane.tolist()
    return found


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
        Largest tilt that counts as drift; see
        :func:`tactile_core.algorithms.levelling.rest_plane`.
    levelled : bool
        Whether to subtract the smooth error; see
        :func:`tactile_core.algorithms.rest_area.height_error`.
    thickness_mm : float
        Thickness of the gel.
    """
    plane = rest_plane(height_mm, gx, gy, mm_per_px=mm_per_px, drift_slope=drift_slope)
    plane.removed_from(height_mm, mm_per_px, out=height_mm)
    if levelled:
        height_mm -= height_error(
            height_mm,
            gx,
            gy,
            mm_per_px=mm_per_px,
            tilt=(plane.slope_x, plane.slope_y),
            thickness_mm=thickness_mm,
        )
