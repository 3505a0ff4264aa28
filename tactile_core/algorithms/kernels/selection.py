"""Order statistics for other kernels; they compile faster than those of numpy.

:func:`quantile_of` is the kernel of :func:`tactile_core.algorithms.arrays.quantile.quantile`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART

_SHIFT, _BINS = 20, 2048
"""Bins by the exponent and the first three bits of the mantissa of a float32 without sign."""

_FEW = 16
"""Values that are sorted by insertion."""


@njit(**PART)
def _divide(values: Any, first: int, last: int) -> tuple[int, int]:
    """Reorder some values into those up to a pivot, and those from it on; return the borders."""
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
    return i, j


@njit(**PART)
def _move_least(values: Any, first: int, place: int) -> None:
    """Reorder ``values`` from ``first`` on until the value at ``place`` is the one when sorted."""
    last = values.size - 1
    while first < last:
        i, j = _divide(values, first, last)
        if place <= j:
            last = j
        elif place >= i:
            first = i
        else:
            return


@njit(**PART)
def sort(values: Any) -> None:
    """Sort (N,) float64 values in place."""
    waiting = np.empty(128, np.int64)
    waiting[0], waiting[1], count = 0, values.size - 1, 2
    while count:
        count -= 2
        first, last = waiting[count], waiting[count + 1]
        while last - first >= _FEW:
            i, j = _divide(values, first, last)
            # the longer part waits, so that few do
            if j - first > last - i:
                waiting[count], waiting[count + 1] = first, j
                first = i
            else:
                waiting[count], waiting[count + 1] = i, last
                last = j
            count += 2
        for k in range(first + 1, last + 1):
            value, at = values[k], k
            while at > first and values[at - 1] > value:
                values[at] = values[at - 1]
                at -= 1
            values[at] = value


@njit(**PART)
def mode_of(values: Any, steps: int, count: int, single: bool) -> tuple[float, float]:
    """Find where (N,) float64 values are densest; they are sorted.

    Parameters
    ----------
    values : (N,) float64
    steps : int
        Steps from one value to the next in an interval; the shortest interval is found.
    count : int
        Number of its values, from the least on, that are averaged.
    single : bool
        Whether lengths are compared in single precision, as of values that come in it.

    Returns
    -------
    mean, length : float
    """
    sort(values)
    first, shortest = 0, np.inf
    for i in range(values.size - steps):
        length = values[i + steps] - values[i]
        if single:
            length = np.float64(np.float32(length))
        if length < shortest:
            first, shortest = i, length
    total = 0.0
    for i in range(first, first + count):
        total += values[i]
    return total / count, shortest


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
    near = np.empty(until - smaller)
    found = 0
    for k in range(bits.size):
        if lowest <= bits[k] >> _SHIFT <= highest:
            near[found] = values[k]
            found += 1
    _move_least(near, 0, below - smaller)
    low = high = near[below - smaller]
    if above > below:
        high = near[above - smaller]
        for k in range(above - smaller, near.size):
            high = min(high, near[k])
    return low + (place - below) * (high - low)


@njit(**PART)
def median_of(values: Any) -> Any:
    """Median of (N,) values, in any order, to single precision of their range."""
    lowest = values[0]
    for k in range(values.size):
        lowest = min(lowest, values[k])
    above = np.empty(values.size, np.float32)
    for k in range(values.size):
        above[k] = values[k] - lowest
    return lowest + quantile_of(above, 0.5)
