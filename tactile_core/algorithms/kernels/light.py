"""Kernels of :mod:`tactile_core.algorithms.drift`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32, UInt8
from tactile_core.algorithms.kernels.options import LOOP
from tactile_core.algorithms.kernels.selection import mode_of


@njit(**LOOP)
def readable_quotients(
    pixels: UInt8,
    hidden: UInt8,
    places: tuple[Any, Any],
    undeformed: Float32,
    bounds: tuple[float, float],
    quotients: Float32,
) -> int:
    """Divide the means of cells of 2 × 2 samples by those of the reference.

    Parameters
    ----------
    pixels : (H, W, K) uint8
    hidden : (H, W) uint8
        Not 0 where a marker hides the gel surface.
    places : ((2 h,), (2 w,)) int
        Rows and columns of the samples.
    undeformed : (K, h w) float32
        Means of the reference; 0 in cells that are not readable there.
    bounds : (dark, saturated)
        A cell is readable if all of its means are between these.
    quotients : (K, h w) float32
        Its first columns are overwritten, one by each readable cell.

    Returns
    -------
    int
        Number of readable cells.
    """
    down, across = places
    dark, saturated = bounds
    means = np.empty(len(undeformed), np.float32)
    columns, count = len(across) // 2, 0
    for cell in range(undeformed.shape[1]):
        i, j = 2 * (cell // columns), 2 * (cell % columns)
        top, bottom, left, right = down[i], down[i + 1], across[j], across[j + 1]
        if (
            hidden[top, left] | hidden[top, right] | hidden[bottom, left] | hidden[bottom, right]
            or undeformed[0, cell] == 0
        ):
            continue
        readable = True
        for k in range(len(means)):
            total = np.float32(pixels[top, left, k]) + np.float32(pixels[top, right, k])
            total += np.float32(pixels[bottom, left, k]) + np.float32(pixels[bottom, right, k])
            means[k] = total / np.float32(4)
            readable &= dark < means[k] < saturated
        if readable:
            for k in range(len(means)):
                quotients[k, count] = means[k] / undeformed[k, cell]
            count += 1
    return count


@njit(**LOOP)
def undeformed_gain(
    logs: Float32, rounds: int, noise_log: float, least_weight: float
) -> tuple[Any, float]:
    """Gain of (K, N) logarithms, and the share of the samples that are consistent with it.

    The arguments are parameters of :class:`tactile_core.algorithms.drift.DriftParameters`.
    """
    channels, count = logs.shape
    gain, pull, values = np.empty(channels), np.empty(channels), np.empty(count)
    for k in range(channels):
        for i in range(count):
            values[i] = logs[k, i]
        gain[k] = mode_of(values, count // 2, count // 2, True)[0]
    scale = 1 / (2 * channels * noise_log**2)
    for _ in range(rounds):
        total = 0.0
        for k in range(channels):
            pull[k] = 0.0
        for i in range(count):
            square = 0.0
            for k in range(channels):
                square += (logs[k, i] - gain[k]) ** 2
            weight = max(1 - square * scale, 0.0) ** 2
            total += weight
            for k in range(channels):
                pull[k] += weight * logs[k, i]
        for k in range(channels):
            gain[k] = pull[k] / max(total, least_weight)
    consistent = 0
    for i in range(count):
        largest = 0.0
        for k in range(channels):
            largest = max(largest, abs(logs[k, i] - gain[k]))
        consistent += largest < 2 * noise_log
    return gain, consistent / count
