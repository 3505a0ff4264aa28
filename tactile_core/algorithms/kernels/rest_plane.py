"""Compiled form of :func:`tactile_core.algorithms.rest_surface.rest_plane`, the definition."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.quantile import SIGMA_PER_MEDIAN
from tactile_core.algorithms.kernels.options import LOOP, PART
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
    kept = np.empty(len(values))
    count = 0
    for i in range(len(values)):
        if sizes[i] <= bound:
            kept[count] = values[i]
            count += 1
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


@njit(**PART)
def _above(plane: Any, x: Any, y: Any, z: Any, out: Any) -> None:
    for i in range(len(z)):
        out[i] = z[i] - plane[0] - x[i] * plane[1] - y[i] * plane[2]


@njit(**PART)
def _robust_plane(
    x: Any,
    y: Any,
    z: Any,
    calm: Any,
    plane: Any,
    sigma: float,
    regression: tuple[int, float, float, float],
) -> None:
    """Tukey's biweight regression of the calm samples; updates ``plane``."""
    rounds, biweight_sigmas, least_sigma, ridge = regression
    count = len(z)
    residual, near, term = np.empty(count), np.empty(count), np.empty(3)
    normal, pull = np.empty((3, 3)), np.empty(3)
    term[0] = 1.0
    samples = 0
    for i in range(count):
        samples += calm[i]
    _above(plane, x, y, z, residual)
    for _ in range(rounds):
        bound = biweight_sigmas * max(sigma, least_sigma)
        for a in range(3):
            pull[a] = 0.0
            for b in range(3):
                normal[a, b] = ridge * samples if a == b else 0.0
        for i in range(count):
            near[i] = abs(residual[i]) / bound if calm[i] else np.inf
            if near[i] < 1:
                weight = (1 - near[i] ** 2) ** 2
                term[1], term[2] = x[i], y[i]
                for a in range(3):
                    pull[a] += weight * term[a] * residual[i]
                    for b in range(3):
                        normal[a, b] += weight * term[a] * term[b]
        _solved(normal, pull)
        for a in range(3):
            plane[a] += pull[a]
        _above(plane, x, y, z, residual)
        for i in range(count):
            residual[i] = abs(residual[i])
        sigma = _SIGMA_PER_MEDIAN * median_of(_up_to(np.nextafter(1.0, 0.0), near, residual))
        _above(plane, x, y, z, residual)


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
    count = across * ((rows - step // 2 + step - 1) // step)
    x, y, z = np.empty(count), np.empty(count), np.empty(count)
    p, q, size = np.empty(count), np.empty(count), np.empty(count)
    _samples(height_mm, step, z)
    _samples(gx, step, p)
    _samples(gy, step, q)
    tilt_x, tilt_y = median_of(p.copy()), median_of(q.copy())
    calm, calm_count = np.empty(count, np.bool_), 0
    for i in range(count):
        x[i] = (step // 2 + i % across * step - (columns - 1) / 2) * mm_per_px
        y[i] = (step // 2 + i // across * step - (rows - 1) / 2) * mm_per_px
        size[i] = np.hypot(p[i] - tilt_x, q[i] - tilt_y)
        calm[i] = size[i] < drift_slope
        calm_count += calm[i]
    if calm_count < least_calm * count or np.hypot(tilt_x, tilt_y) > drift_slope:
        for i in range(count):
            size[i] = np.hypot(p[i], q[i])
        return _mode(_up_to(median_of(size.copy()), size, z), levels[2])[0], 0.0, 0.0
    levelled = np.empty(count)
    plane = np.empty(3)
    plane[0], plane[1], plane[2] = 0.0, tilt_x, tilt_y
    _above(plane, x, y, z, levelled)
    flat = _up_to(median_of(size.copy()), size, levelled)
    of_calm, kept = np.empty(calm_count), 0
    least = most = levelled[0]
    for i in range(count):
        least, most = min(least, levelled[i]), max(most, levelled[i])
        if calm[i]:
            of_calm[kept] = levelled[i]
            kept += 1
    apart = levels[0] * (most - least)
    level, spread = _lower_level(flat, of_calm, apart, levels, regression[1])
    plane[0] = level
    _robust_plane(x, y, z, calm, plane, spread, regression)
    if np.hypot(plane[1], plane[2]) > drift_slope:
        return level, tilt_x, tilt_y
    return plane[0], plane[1], plane[2]
