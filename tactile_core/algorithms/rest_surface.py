"""Where the untouched skin lies in a height map whose constant, and a little tilt, are unknown."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.half_sample import narrowest
from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.types import Array

_SAMPLES = 1200
_ROUNDS = 3
_CUT_SIGMAS = 4.5
_LEAST_CALM = 0.3
_BULGE, _LEAST_BELOW = 0.3, 0.2
_FLOOR_MM = 1e-6


class RestPlane(NamedTuple):
    """The rest surface: ``level_mm`` at the image centre, rising by ``slope_x`` and ``slope_y``."""

    level_mm: float
    slope_x: float
    slope_y: float

    def removed_from(self, height_mm: Array, mm_per_px: float, out: Array | None = None) -> Array:
        """Return the (H, W) height above this plane, in the dtype of ``height_mm``.

        ``out`` may hold the result; ``height_mm`` itself as well.
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
    """Find the surface of the skin out of contact.

    Slopes that are all a little off in the same direction, as after a change of the light, tilt
    the height map as a whole. So a plane is fitted to it, robustly: it starts from the median
    slope and the commonest height of the flatter half of the pixels, and then leaves out what
    stands out of the plane, as contacts do. The tilt is taken for drift only when it is below
    ``drift_slope`` and when at least 30 % of the pixels have that slope to within ``drift_slope``;
    else something else than rest fills the image, and only the level is found: the commonest
    height of the flatter half.

    An object raises the skin, and beside it the skin bulges down by at most a third of that. So if
    a fifth of the pixels lie still further below the commonest height, that is a flat object's, and
    the rest surface is down there. Robust up to contacts on about 60 % of the image. A press
    that covers the whole image has no rest to be measured from; its shape stays as it is, unless it
    is a mere tilt below ``drift_slope``, which nothing tells from drift.

    Parameters
    ----------
    height_mm, gx, gy : (H, W)
        The height and the slopes that it was integrated from.
    mm_per_px : float
        Scale of the image.
    drift_slope : float
        The largest tilt that is taken for drift; 0 finds the level alone.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.
    """
    rows, columns = height_mm.shape
    step = max(1, int(np.sqrt(rows * columns / _SAMPLES)))
    loops = kernels.chosen(compiled)
    if loops is not None:
        regression = _ROUNDS, _CUT_SIGMAS, _FLOOR_MM
        levels = _BULGE, _LEAST_BELOW
        images = height_mm, gx, gy
        return RestPlane(
            *loops.rest_plane(images, step, mm_per_px, drift_slope, _LEAST_CALM, levels, regression)
        )
    z, p, q = (
        a[step // 2 :: step, step // 2 :: step].ravel().astype(float) for a in (height_mm, gx, gy)
    )
    y, x = (from_middle(side)[step // 2 :: step] * mm_per_px for side in (rows, columns))
    x, y = np.tile(x, len(y)), np.repeat(y, len(x))
    tilt = float(np.median(p)), float(np.median(q))
    deviation = np.hypot(p - tilt[0], q - tilt[1])
    calm = deviation < drift_slope
    if calm.sum() < _LEAST_CALM * len(calm) or np.hypot(*tilt) > drift_slope:
        slope = np.hypot(p, q)
        return RestPlane(_mode(z[slope <= np.median(slope)])[0], 0.0, 0.0)
    upright = z - tilt[0] * x - tilt[1] * y
    apart = _BULGE * (upright.max() - upright.min())
    level, spread = _lower_level(upright[deviation <= np.median(deviation)], upright[calm], apart)
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
    return float(ordered[first : first + half].mean()), float(length) / 1.349


def _lower_level(flat: Array, calm: Array, apart: float) -> tuple[float, float]:
    """The commonest height of the flat values; if calm ones lie this far below it, theirs."""
    level, spread = _mode(flat)
    below = calm[calm < level - apart]
    if len(below) >= _LEAST_BELOW * len(calm):
        level, spread = _mode(below)
    return level, min(spread, apart / _CUT_SIGMAS)


def _robust_plane(terms: Array, z: Array, plane: Array, sigma: float) -> Array:
    """Tukey's biweight regression of (N,) on (3, N) terms from a good start."""
    # a tiny ridge keeps an image of one row or one column solvable
    ridge = 1e-12 * len(z) * np.eye(3)
    residual = z - plane @ terms
    for _ in range(_ROUNDS):
        near = residual / (_CUT_SIGMAS * max(sigma, _FLOOR_MM))
        near *= near
        weighted = terms * np.square(1 - np.minimum(near, 1))
        plane = plane + np.linalg.solve(weighted @ terms.T + ridge, weighted @ residual)
        residual = z - plane @ terms
        sigma = sigma_of(residual[near < 1])
    return plane
