"""Kernels of :mod:`tactile_core.algorithms.markers`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP


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
    """Sums of w, wx, wy, wxx, wxy and wyy of each label.

    Parameters
    ----------
    labels : (h, w) uint16
        0: of no spot.
    weight : (h, w) uint8
    count : int
        Labels, with 0.

    Returns
    -------
    (6, count) float64
    """
    sums = np.zeros((6, count))
    for i in range(labels.shape[0]):
        _add_row(labels[i], weight[i], i, sums)
    return sums


@njit(**EXACT_ROW)
def _mean_of_four(a: Any, b: Any, c: Any, d: Any) -> Any:
    return (np.uint32(a) + np.uint32(b) + np.uint32(c) + np.uint32(d) + np.uint32(2)) >> 2


@njit(**EXACT_ROW)
def _brightness_row(upper: Any, lower: Any, brightness: Any) -> None:
    for j in range(brightness.size):
        i = 6 * j
        total = _mean_of_four(upper[i], upper[i + 3], lower[i], lower[i + 3])
        total += _mean_of_four(upper[i + 1], upper[i + 4], lower[i + 1], lower[i + 4])
        total += _mean_of_four(upper[i + 2], upper[i + 5], lower[i + 2], lower[i + 5])
        # a third, by a product that vectors can do
        brightness[j] = np.uint8(((total + np.uint32(1)) * np.uint32(21846)) >> 16)


@njit(**LOOP)
def halved_brightness(rows: Any) -> Any:
    """Mean of three channels at half the size, rounded after each step as OpenCV rounds it.

    Parameters
    ----------
    rows : (H, 3 W) uint8
        Interleaved channels; H and W are even.

    Returns
    -------
    (H / 2, W / 2) uint8
    """
    brightness = np.empty((rows.shape[0] // 2, rows.shape[1] // 6), np.uint8)
    for i in range(len(brightness)):
        _brightness_row(rows[2 * i], rows[2 * i + 1], brightness[i])
    return brightness
