"""Compiled form of :func:`tactile_core.algorithms.rest_surface.rest_plane`, the definition."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.quantile import SIGMA_PER_MEDIAN
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.selection import median_of, mode_of

_SIGMA_PER_MEDIAN = SIGMA_PER_MEDIAN


@njit(**PART)
def _mode(values: Any, half_width_sigmas: float) -> tuple[float, float]:
    half = (len(values) + 1) // 2
    level, length = mode_of(values, half - 1, half, False)
    return level, length / half_width_sigmas


@njit(**PART)
def _up_to(bound: float, sizes: Any, values: Any) -> Any:
    """Return the values whose sizes are at most ``bound``."""
    kept = np.empty(len(values) + 1)
    count = 0
    for i in range(len(values)):
        # no branch, which a processor could not guess
        kept[count] = values[i]
        count += sizes[i] <= bound
    return kept[:count]


@njit(**PART)
def _lower_level(
    flat: Any, calm: Any, apart: float, levels: tuple[float, float, float], biweight_sigmas: float
) -> tuple[float, float]:
    """Mode of the flat values, or of the calm ones that are ``apart`` below it if enough are."""
    _, least_below, half_width_sigmas = levels
    level, spread = _mode(flat, half_width_sigmas)
    below = _up_to(np.nextafter(level - apart, -np.inf), calm, calm)
    if len(below) >= least_below * len(calm):
        level, spread = _mode(below, half_width_sigmas)
    return level, min(spread, apart / biweight_sigmas)


@njit(**PART)
def _solved(a: Any, b: Any) -> None:
    """Solve 3 × 3 equations with a positive matrix; overwrites b by the solution, and a."""
    for i in range(3):
        for k in range(i + 1, 3):
            share = a[k, i] / a[i, i]
            for j in range(3):
                a[k, j] -= share * a[i, j]
            b[k] -= share * b[i]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]


@njit(**EXACT_ROW)
def _above(x: Any, y: Any, z: Any, plane: tuple[Any, Any, Any], out: Any) -> None:
    level, across, down = plane
    for i in range(out.size):
        out[i] = z[i] - level - x[i] * across - y[i] * down


@njit(**EXACT_ROW)
def _sizes(p: Any, q: Any, p0: Any, q0: Any, out: Any) -> None:
    for i in range(out.size):
        across, down = p[i] - p0, q[i] - q0
        out[i] = np.sqrt(across * across + down * down)


@njit(**EXACT_ROW)
def _nearness(residual: Any, bound: Any, near: Any) -> None:
    for i in range(near.size):
        near[i] = abs(residual[i]) / bound


@njit(**ROW)
def _weighted_sums(x: Any, y: Any, residual: Any, near: Any) -> tuple[Any, ...]:
    """Sums of Tukey's weights, and of their products with the terms and with the residuals."""
    one = of_x = of_y = xx = xy = yy = left = left_x = left_y = 0.0
    for i in range(near.size):
        inside = max(1 - near[i] * near[i], 0.0)
        weight = inside * inside
        wx, wy = weight * x[i], weight * y[i]
        one += weight
        of_x += wx
        of_y += wy
        xx += wx * x[i]
        xy += wx * y[i]
        yy += wy * y[i]
        left += weight * residual[i]
        left_x += wx * residual[i]
        left_y += wy * residual[i]
    return one, of_x, of_y, xx, xy, yy, left, left_x, left_y


@njit(**PART)
def _robust_plane(
    samples: tuple[Any, Any, Any],
    plane: tuple[float, float, float],
    sigma: float,
    regression: tuple[int, float, float, float],
) -> tuple[float, float, float]:
    """Tukey's biweight regression of samples (x, y, z), from a good start."""
    rounds, biweight_sigmas, least_sigma, ridge = regression
    x, y, z = samples
    residual, near, size = np.empty(len(z)), np.empty(len(z)), np.empty(len(z))
    normal, pull = np.empty((3, 3)), np.empty(3)
    _above(x, y, z, plane, residual)
    for _ in range(rounds):
        _nearness(residual, biweight_sigmas * max(sigma, least_sigma), near)
        one, of_x, of_y, xx, xy, yy, left, left_x, left_y = _weighted_sums(x, y, residual, near)
        damping = ridge * len(z)
        normal[0, 0], normal[1, 1], normal[2, 2] = one + damping, xx + damping, yy + damping
        normal[0, 1] = normal[1, 0] = of_x
        normal[0, 2] = normal[2, 0] = of_y
        normal[1, 2] = normal[2, 1] = xy
        pull[0], pull[1], pull[2] = left, left_x, left_y
        _solved(normal, pull)
        plane = plane[0] + pull[0], plane[1] + pull[1], plane[2] + pull[2]
        _above(x, y, z, plane, residual)
        kept = 0
        for i in range(near.size):
            if near[i] < 1:
                size[kept] = abs(residual[i])
                kept += 1
        if not kept:
            break
        sigma = _SIGMA_PER_MEDIAN * median_of(size[:kept])
    return plane


@njit(**PART)
def _samples(image: Any, step: int, out: Any) -> None:
    at = 0
    for i in range(step // 2, image.shape[0], step):
        for j in range(step // 2, image.shape[1], step):
            out[at] = image[i, j]
            at += 1


@njit(**LOOP)
def rest_plane(
    images: tuple[Any, Any, Any],
    step: int,
    mm_per_px: float,
    drift_slope: float,
    least_calm: float,
    levels: tuple[float, float, float],
    regression: tuple[int, float, float, float],
) -> tuple[float, float, float]:
    """Level and slopes of the undeformed gel surface.

    Parameters
    ----------
    images : (height_mm, gx, gy)
        (H, W) each.
    step : int
        Distance between samples in px.
    mm_per_px, drift_slope : float
        See :func:`tactile_core.algorithms.rest_surface.rest_plane`.
    least_calm : float
        Share of calm samples from which a tilt counts as drift.
    levels : (bulge ratio, least share, half width)
        A lower level counts if it is further below than the bulge and has this share of samples.
        The half width is the length of the shortest half of a normal distribution.
    regression : (rounds, biweight sigmas, least sigma, ridge)
        Parameters of Tukey's biweight.

    Returns
    -------
    level_mm, slope_x, slope_y : float
    """
    height_mm, gx, gy = images
    rows, columns = height_mm.shape
    across = (columns - step // 2 + step - 1) // step
    down = (rows - step // 2 + step - 1) // step
    count = across * down
    x, y, z = np.empty(count), np.empty(count), np.empty(count)
    p, q, size = np.empty(count), np.empty(count), np.empty(count)
    _samples(height_mm, step, z)
    _samples(gx, step, p)
    _samples(gy, step, q)
    tilt_x, tilt_y = median_of(p), median_of(q)
    _sizes(p, q, tilt_x, tilt_y, size)
    calm_count = 0
    for i in range(count):
        calm_count += size[i] < drift_slope
    if calm_count < least_calm * count or np.hypot(tilt_x, tilt_y) > drift_slope:
        _sizes(p, q, 0.0, 0.0, size)
        return _mode(_up_to(median_of(size), size, z), levels[2])[0], 0.0, 0.0
    for i in range(down):
        for j in range(across):
            x[i * across + j] = (step // 2 + j * step - (columns - 1) / 2) * mm_per_px
            y[i * across + j] = (step // 2 + i * step - (rows - 1) / 2) * mm_per_px
    levelled = np.empty(count)
    _above(x, y, z, (0.0, tilt_x, tilt_y), levelled)
    flat = _up_to(median_of(size), size, levelled)
    least = most = levelled[0]
    for i in range(count):
        least, most = min(least, levelled[i]), max(most, levelled[i])
    apart = levels[0] * (most - least)
    below = np.nextafter(drift_slope, 0.0)
    calm = _up_to(below, size, x), _up_to(below, size, y), _up_to(below, size, z)
    of_calm = _up_to(below, size, levelled)
    level, spread = _lower_level(flat, of_calm, apart, levels, regression[1])
    plane = _robust_plane(calm, (level, tilt_x, tilt_y), spread, regression)
    if np.hypot(plane[1], plane[2]) > drift_slope:
        return level, tilt_x, tilt_y
    return plane[0], plane[1], plane[2]
