"""Operations on the rows of images, for other kernels."""

from __future__ import annotations

from typing import Any

from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, ROW


@njit(**ROW)
def add_row(row: Any, total: Any) -> None:
    """Add a row to sums."""
    for j in range(total.size):
        total[j] += row[j]


@njit(**EXACT_ROW)
def copy_row(row: Any, out: Any) -> None:
    """Copy a row; assigning a slice takes ten times as long."""
    for j in range(row.size):
        out[j] = row[j]


@njit(**EXACT_ROW)
def set_row(row: Any, value: Any) -> None:
    """Set each value of a row."""
    for j in range(row.size):
        row[j] = value


@njit(**EXACT_ROW)
def sum_of_two(one: Any, other: Any, out: Any) -> None:
    """Write the sum of two rows."""
    for j in range(out.size):
        out[j] = one[j] + other[j]
