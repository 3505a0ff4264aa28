"""Kernel of :func:`tactile_core.algorithms.arrays.quantile.quantile`, for other kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP

_SHIFT, _BINS = 20, 2048
"""Bins by the exponent and the first three bits of the mantissa of a float32 without sign."""


@njit(**LOOP)
def _move_least(values: Any, first: int, place: int) -> None:
    """Reorder ``values`` from ``first`` on until the value at ``place`` is the one when sorted."""
    last = values.size - 1
    while first < last:
        pivot, i, j = values[(first + last) // 2], first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if place <= j:
            last = j
        elif place >= i:
            first = i
        else:
            return


@njit(**LOOP)
def quantile_of(values: Any, share: float) -> Any:
    """Quantile of (N,) float32 values, none below 0, interpolated linearly.

    Values are counted by their bits, which are ordered as they are; only those of one bin, in which
    the quantile is, are sorted as far as necessary.
    """
    place = share * (values.size - 1)
    below = int(place)
    above = min(below + 1, values.size - 1)
    bits = values.view(np.uint32)
    counts = np.zeros(_BINS, np.int32)
    for k in range(bits.size):
        counts[bits[k] >> _SHIFT] += 1
    smaller, lowest = 0, 0
    while smaller + counts[lowest] <= below:
        smaller += counts[lowest]
        lowest += 1
    highest, until = lowest, smaller + counts[lowest]
    while until <= above:
        highest += 1
        until += counts[highest]
    near = np.empty(until - smaller, np.float32)
    found = 0
    for k in range(bits.size):
        if lowest <= bits[k] >> _SHIFT <= highest:
            near[found] = values[k]
            found += 1
    _move_least(near, 0, below - smaller)
    low = high = np.float64(near[below - smaller])
    if above > below:
        high = np.float64(near[above - smaller :].min())
    return low + (place - below) * (high - low)
