"""Kernels of :func:`tactile_core.algorithms.photometric.fill_marks`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP


@njit(**EXACT_ROW)
def _add(row: Any, total: Any) -> None:
    for j in range(total.size):
        total[j] += np.uint16(row[j])


@njit(**EXACT_ROW)
def _every(total: Any, channels: Any, times: Any, mean: Any) -> None:
    share = np.float32(times * times)
    for j in range(mean.size // channels):
        for k in range(channels):
            mean[j * channels + k] = np.rint(np.float32(total[j * times * channels + k]) / share)


@njit(**LOOP)
def means_of_bytes(rows: NDArray[np.uint8], channels: int, times: int) -> NDArray[np.float32]:
    """Means over squares of ``times`` pixels' side, rounded to bytes as OpenCV rounds them.

    Parameters
    ----------
    rows : (H, W K) uint8
        Interleaved channels; ``times`` divides H and W, and is at most 16.
    channels, times : int
        K, and the side of a square; 2 is rounded otherwise by OpenCV.

    Returns
    -------
    (H / times, W / times K) float32
        Whole numbers.
    """
    height, width = len(rows) // times, rows.shape[1] // times
    means = np.empty((height, width), np.float32)
    # behind the row there is room for neighbours that only the last, unused sums have
    column = np.zeros(rows.shape[1] + times * channels, np.uint16)
    square = np.empty(rows.shape[1], np.uint16)
    for i in range(height):
        column[:] = 0
        for k in range(times):
            _add(rows[i * times + k], column[: rows.shape[1]])
        square[:] = 0
        for k in range(times):
            _add(column[k * channels :], square)
        _every(square, channels, times, means[i])
    return means
