"""Kernels of :mod:`tactile_core.algorithms.markers`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP


@njit(**LOOP)
def _add_row(labels: Any, weight: Any, y: int, sums: Any) -> None:
    j = 0
    while j < labels.size:
        of = labels[j]
        if of == 0:
            j += 1
            continue
        left = j
        total = first = second = np.int64(0)
        while j < labels.size and labels[j] == of:
            w, x = np.int64(weight[j]), np.int64(j - left)
            total += w
            first += w * x
            second += w * x * x
            j += 1
        if of < sums.shape[1]:
            wx = first + total * left
            sums[0, of] += total
            sums[1, of] += wx
            sums[2, of] += total * y
            sums[3, of] += second + left * (first + wx)
            sums[4, of] += wx * y
            sums[5, of] += total * y * y


@njit(**LOOP)
def moments_of_labels(labels: Any, weight: Any, count: int) -> Any:
    """Sum w, wx, wy, wxx, wxy and wyy of each label.

    Parameters
    ----------
    labels : (h, w) uint16
        0 outside the spots.
    weight : (h, w) uint8
    count : int
        Number of labels, including 0.

    Returns
    -------
    (6, count) float64
    """
    sums = np.zeros((6, count))
    for i in range(labels.shape[0]):
        _add_row(labels[i], weight[i], i, sums)
    return sums
