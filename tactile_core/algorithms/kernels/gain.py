"""Kernels of :mod:`tactile_core.algorithms.rest_surface` and of ``drift``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, ROW


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
    """Refine a gain by Tukey's biweight on (K, N) logarithms of all channels at once.

    Returns
    -------
    gain : (K,) float64
    share : float
        Share of the samples that agree with it.
    """
    channels, count = logs.shape
    gain = gain.astype(np.float64)
    for _ in range(rounds):
        total = 0.0
        pull = np.zeros(channels)
        for i in range(count):
            square = 0.0
            for k in range(channels):
                square += ((logs[k, i] - gain[k]) / near) ** 2
            weight = max(1 - square / (2 * channels), 0.0) ** 2
            total += weight
            for k in range(channels):
                pull[k] += weight * logs[k, i]
        gain = pull / max(total, 1e-6)
    agreeing = 0
    for i in range(count):
        farthest = 0.0
        for k in range(channels):
            farthest = max(farthest, abs(logs[k, i] - gain[k]))
        agreeing += farthest < 2 * near
    return gain, agreeing / count
