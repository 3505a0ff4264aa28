"""Kernel of :mod:`tactile_core.algorithms.validity`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP


@njit(**EXACT_ROW)
def _usable(row: Any, first: Any, span: Any, usable: Any) -> None:
    for k in range(usable.size):
        # below the first the difference of bytes wraps around
        usable[k] = np.uint8(row[k] - first) <= span


@njit(**EXACT_ROW)
def _two_of_three(usable: Any, two: Any) -> None:
    for k in range(two.size):
        first, second = usable[k], usable[k + 1]
        two[k] = (first & second) | (usable[k + 2] & (first | second))


@njit(**EXACT_ROW)
def _every_third(two: Any, valid: Any) -> None:
    for j in range(valid.size):
        valid[j] = two[3 * j]


@njit(**LOOP)
def two_of_three_within(rows: Any, first: int, last: int) -> Any:
    """Whether at least two of three channels are within bounds.

    Parameters
    ----------
    rows : (H, 3 W) uint8
        Interleaved channels.
    first, last : int
        The lowest and the highest byte within.

    Returns
    -------
    (H, W) uint8
        0 or 1.
    """
    width = rows.shape[1]
    valid = np.empty((len(rows), width // 3), np.uint8)
    usable, two = np.empty(width, np.uint8), np.empty(width - 2, np.uint8)
    for i in range(len(rows)):
        _usable(rows[i], np.uint8(first), np.uint8(last - first), usable)
        _two_of_three(usable, two)
        _every_third(two, valid[i])
    return valid
