"""Operations on the rows of images, for other kernels."""

from __future__ import annotations

from typing import Any

from numba import njit

from tactile_core.algorithms.kernels.options import ROW


@njit(**ROW)
def add_row(row: Any, total: Any) -> None:
    """Add a row to sums."""
    for j in range(total.size):
        total[j] += row[j]
