"""Kernels of :mod:`tactile_core.algorithms.rest` and :mod:`tactile_core.algorithms.drift`.

Both work on about a thousand samples, where each call of numpy costs more than its arithmetic.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, ROW


@njit(**LOOP)
def _commonest(values: Any) -> tuple[float, float]:
    ordered = np.sort(values)
    half = (len(ordered) + 1) // 2
    first, shortest = 0, np.inf
    for i in range(len(ordered) - half + 1):
        length = ordered[i + half - 1] - ordered[i]
        if length < shortest:
            first, shortest = i, length
    return ordered[first : first + half].mean(), shortest / 1.349


@njit(**LOOP)
def _solved(a: Any, b: Any) -> Any:
    """Solve 3 × 3 equations of a positive matrix, both of which are overwritten."""
    for i in range(3):
        for k in range(i + 1, 3):
            share = a[k, i] / a[i, i]
            a[k] -= share * a[i]
            b[k] -= share * b[i]
    for i in range(2, -1, -1):
        for k in range(i + 1, 3):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    return b


@njit(**LOOP)
def _robust_plane(
    terms: Any, z: Any, plane: Any, sigma: float, rounds: int, cut: float, least: float
) -> Any:
    """Tukey's biweight regression of (N,) on (N, 3) terms."""
    count = len(z)
    near = np.empty(count)
    rest = np.empty(count)
    for _ in range(rounds):
        normal = 1e-12 * count * np.eye(3)
        pull = np.zeros(3)
        bound = cut * max(sigma, least)
        for i in range(count):
            row = terms[i]
            residual = z[i] - row[0] * plane[0] - row[1] * plane[1] - row[2] * plane[2]
            near[i] = abs(residual) / bound
            if near[i] < 1:
                weight = (1 - near[i] ** 2) ** 2
                for a in range(3):
                    pull[a] += weight * row[a] * residual
                    for b in range(3):
                        normal[a, b] += weight * row[a] * row[b]
        plane = plane + _solved(normal, pull)
        inside = 0
        for i in range(count):
            if near[i] < 1:
                row = terms[i]
                rest[inside] = abs(z[i] - row[0] * plane[0] - row[1] * plane[1] - row[2] * plane[2])
                inside += 1
        sigma = 1.4826 * np.median(rest[:inside])
    return plane


@njit(**LOOP)
def _samples(image: Any, step: int) -> Any:
    return image[step // 2 :: step, step // 2 :: step].astype(np.float64).copy().reshape(-1)


@njit(**LOOP)
def rest_plane(
    images: tuple[Any, Any, Any],
    step: int,
    mm_per_px: float,
    drift_slope: float,
    least_calm: float,
    regression: tuple[int, float, float],
) -> Any:
    """Level and slopes of the skin out of contact.

    Parameters
    ----------
    images : (height_mm, gx, gy)
        (H, W) each.
    step : int
        Pixels from sample to sample.
    mm_per_px, drift_slope, least_calm : float
        See :func:`tactile_core.algorithms.rest.rest_plane`.
    regression : (rounds, cut, least sigma)
        Of Tukey's biweight.

    Returns
    -------
    (3,) float64
    """
    height_mm, gx, gy = images
    rows, columns = height_mm.shape
    z, p, q = _samples(height_mm, step), _samples(gx, step), _samples(gy, step)
    count = len(z)
    terms = np.ones((count, 3))
    across = len(range(step // 2, columns, step))
    for i in range(count):
        terms[i, 1] = (step // 2 + i % across * step - (columns - 1) / 2) * mm_per_px
        terms[i, 2] = (step // 2 + i // across * step - (rows - 1) / 2) * mm_per_px
    tilt_x, tilt_y = np.median(p), np.median(q)
    deviation = np.hypot(p - tilt_x, q - tilt_y)
    calm = deviation < drift_slope
    if calm.mean() < least_calm or np.hypot(tilt_x, tilt_y) > drift_slope:
        slope = np.hypot(p, q)
        return np.array([_commonest(z[slope <= np.median(slope)])[0], 0.0, 0.0])
    flatter = deviation <= np.median(deviation)
    level, spread = _commonest((z - tilt_x * terms[:, 1] - tilt_y * terms[:, 2])[flatter])
    start = np.array([level, tilt_x, tilt_y])
    rounds, cut, least = regression
    plane = _robust_plane(terms[calm], z[calm], start, spread, rounds, cut, least)
    return start if np.hypot(plane[1], plane[2]) > drift_slope else plane


@njit(**ROW)
def _lower_row(row: Any, level: Any, across: Any) -> None:
    for j in range(row.size):
        row[j] = row[j] - level - across[j]


@njit(**LOOP)
def lower(height_mm: Any, levels: Any, across: Any) -> None:
    """Take a level per row and one per column off an (H, W) height."""
    for i in range(len(height_mm)):
        _lower_row(height_mm[i], levels[i], across)


@njit(**LOOP)
def resting_gain(logs: Any, gain: Any, near: float, rounds: int) -> tuple[Any, float]:
    """Refine a gain by Tukey's biweight on (N, K) logarithms of all channels at once.

    Returns
    -------
    gain : (K,) float64
    share : float
        Share of the samples that agree with it.
    """
    count, channels = logs.shape
    gain = gain.astype(np.float64)
    for _ in range(rounds):
        total = 0.0
        pull = np.zeros(channels)
        for i in range(count):
            square = 0.0
            for k in range(channels):
                square += ((logs[i, k] - gain[k]) / near) ** 2
            weight = max(1 - square / (2 * channels), 0.0) ** 2
            total += weight
            for k in range(channels):
                pull[k] += weight * logs[i, k]
        gain = pull / max(total, 1e-6)
    agreeing = 0
    for i in range(count):
        farthest = 0.0
        for k in range(channels):
            farthest = max(farthest, abs(logs[i, k] - gain[k]))
        agreeing += farthest < 2 * near
    return gain, agreeing / count
