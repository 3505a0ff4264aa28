"""Rest surface: the undeformed gel surface in a height map of unknown offset and slight tilt."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.half_sample import narrowest
from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.quantile import quantile, sigma_of
from tactile_core.algorithms.arrays.types import Array


class RestParameters(NamedTuple):
    """Parameters of the search for the rest surface. What a user may set is the largest tilt.

    Attributes
    ----------
    samples : int, count
        Approximate number of pixels that are used.
        Source: chosen by hand; no script derives it.
    rounds : int, count
        Reweightings of the biweight regression.
        Source: chosen by hand; no script derives it.
    biweight_sigmas : float, standard deviations
        Residuals beyond it have no weight.
        Source: chosen by hand; near the 4.685 that gives the biweight an efficiency of 95 % on
        normal residuals.
    least_calm_share : float, share of the samples
        Samples near the median slope that a tilt takes to count as drift.
        Source: chosen by hand; no script derives it.
    bulge_ratio : float, share of the range of heights
        The surface next to an object bulges down by less than this.
        Source: chosen by hand; by the mechanics of the virtual gel it is at most a third.
    least_below_share : float, share of the calm samples
        With this many samples below the bulge, they are the rest surface.
        Source: chosen by hand; no script derives it.
    least_sigma_mm : float, mm
        Lower bound of the residual scale, against division by zero.
        Source: chosen by hand; no script derives it.
    half_width_sigmas : float, standard deviations
        Length of the shortest interval that holds half of a normal distribution.
        Source: the interquartile range of the normal distribution, 2 × 0.6745.
    ridge : float, per sample
        Makes an image of one row or one column solvable.
        Source: chosen by hand; no script derives it.
    """

    samples: int = 1200
    rounds: int = 3
    biweight_sigmas: float = 4.5
    least_calm_share: float = 0.3
    bulge_ratio: float = 0.3
    least_below_share: float = 0.2
    least_sigma_mm: float = 1e-6
    half_width_sigmas: float = 1.349
    ridge: float = 1e-12


REST = RestParameters()
"""The values in use."""


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
    compiled: bool = False,
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
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    References
    ----------
    .. [1] A. E. Beaton and J. W. Tukey, "The fitting of power series, meaning polynomials,
       illustrated on band-spectroscopic data", Technometrics 16(2), 1974.
    .. [2] D. F. Andrews et al., "Robust Estimates of Location: Survey and Advances", Princeton
       University Press, 1972.
    """
    rows, columns = height_mm.shape
    step = max(1, int(np.sqrt(rows * columns / REST.samples)))
    loops = kernels.chosen(compiled)
    if loops is not None:
        regression = REST.rounds, REST.biweight_sigmas, REST.least_sigma_mm, REST.ridge
        levels = REST.bulge_ratio, REST.least_below_share, REST.half_width_sigmas
        images = height_mm, gx, gy
        least_calm = REST.least_calm_share
        return RestPlane(
            *loops.rest_plane(images, step, mm_per_px, drift_slope, least_calm, levels, regression)
        )
    z, p, q = (
        a[step // 2 :: step, step // 2 :: step].ravel().astype(float) for a in (height_mm, gx, gy)
    )
    y, x = (from_middle(side)[step // 2 :: step] * mm_per_px for side in (rows, columns))
    x, y = np.tile(x, len(y)), np.repeat(y, len(x))
    tilt = quantile(p, 0.5), quantile(q, 0.5)
    deviation = np.hypot(p - tilt[0], q - tilt[1])
    calm = deviation < drift_slope
    if calm.sum() < REST.least_calm_share * len(calm) or np.hypot(*tilt) > drift_slope:
        slope = np.hypot(p, q)
        return RestPlane(_mode(z[slope <= quantile(slope, 0.5)])[0], 0.0, 0.0)
    levelled = z - tilt[0] * x - tilt[1] * y
    apart = REST.bulge_ratio * (levelled.max() - levelled.min())
    flat = levelled[deviation <= quantile(deviation, 0.5)]
    level, spread = _lower_level(flat, levelled[calm], apart)
    terms = np.stack([np.ones_like(x), x, y])[:, calm]
    plane = _robust_plane(terms, z[calm], np.array([level, *tilt]), spread)
    if np.hypot(plane[1], plane[2]) > drift_slope:
        return RestPlane(level, *tilt)
    return RestPlane(*plane.tolist())


def _mode(values: Array) -> tuple[float, float]:
    """Mean of the shortest interval that holds half of the values, and a sigma from its length."""
    ordered = np.sort(values)
    half = (len(ordered) + 1) // 2
    first, length = narrowest(ordered, half)
    spread = float(length) / REST.half_width_sigmas
    return float(ordered[first : first + half].mean()), spread


def _lower_level(flat: Array, calm: Array, apart: float) -> tuple[float, float]:
    """Mode of the flat values, or of the calm ones that are ``apart`` below it if enough are."""
    level, spread = _mode(flat)
    below = calm[calm < level - apart]
    if len(below) >= REST.least_below_share * len(calm):
        level, spread = _mode(below)
    return level, min(spread, apart / REST.biweight_sigmas)


def _robust_plane(terms: Array, z: Array, plane: Array, sigma: float) -> Array:
    """Tukey's biweight regression of (N,) heights on (3, N) terms, from a good start."""
    ridge = REST.ridge * len(z) * np.eye(3)
    residual = z - plane @ terms
    for _ in range(REST.rounds):
        near = residual / (REST.biweight_sigmas * max(sigma, REST.least_sigma_mm))
        near *= near
        weighted = terms * np.square(1 - np.minimum(near, 1))
        plane = plane + np.linalg.solve(weighted @ terms.T + ridge, weighted @ residual)
        residual = z - plane @ terms
        sigma = sigma_of(residual[near < 1])
    return plane
