"""Kernels of :mod:`tactile_core.algorithms.contact`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, ROW


@njit(**ROW)
def _steepness_of_row(above: Any, row: Any, below: Any, scale: Any, steepness: Any) -> None:
    for j in range(1, row.size - 1):
        across, down = row[j + 1] - row[j - 1], below[j] - above[j]
        steepness[j] = scale * np.sqrt(across * across + down * down)


@njit(**LOOP)
def steepness(height: Any, scale: float) -> Any:
    """``scale`` times the size of the central differences; mirrored at the border."""
    rows, columns = height.shape
    out = np.empty((rows, columns), np.float32)
    for i in range(rows):
        above = height[i - 1] if i > 0 else height[min(1, rows - 1)]
        below = height[i + 1] if i < rows - 1 else height[max(rows - 2, 0)]
        _steepness_of_row(above, height[i], below, np.float32(scale), out[i])
        for j in (0, columns - 1):
            out[i, j] = scale * abs(below[j] - above[j])
    return out
