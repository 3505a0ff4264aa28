"""Order statistics for other kernels; they compile faster than those of numpy.

:func:`quantile_of` is the kernel of :func:`tactile_core.algorithms.arrays.quantile.quantile`.
Values are first distributed by counting, where no branch depends on a value: a processor cannot
guess comparisons of values in random order, and waits for each.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART, ROW

_SHIFTS = 20, 9
"""Low bits that two counts ignore of a float32 without sign, whose bits are ordered as it is."""

_BINS = 2048
"""Bins of a count, by eleven bits."""

_FEW = 16
"""Values that are sorted by insertion, or one of which is found without counting."""

_LEAST_RANGE = 1e-290
"""Keeps a divisor from 0, and its inverse finite."""


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
def _order_roughly(values: Any) -> None:
    """Order (N,) values by N bins of equal width."""
    count = values.size
    lowest = highest = values[0]
    for k in range(count):
        lowest, highest = min(lowest, values[k]), max(highest, values[k])
    per_unit = (count - 1) / max(highest - lowest, _LEAST_RANGE)
    unordered, bins = values.copy(), np.empty(count, np.int32)
    places = np.zeros(count + 1, np.int32)
    for k in range(count):
        scaled = (values[k] - lowest) * per_unit
        # whatever the values are, no place is outside the array
        bins[k] = np.int32(scaled) if 0 < scaled < count else 0
    for k in range(count):
        places[bins[k] + 1] += 1
    for k in range(count):
        places[k + 1] += places[k]
    for k in range(count):
        place = places[bins[k]]
        values[place] = unordered[k]
        places[bins[k]] = place + 1


@njit(**PART)
def sort(values: Any) -> None:
    """Sort (N,) finite float64 values in place."""
    if values.size > _FEW:
        _order_roughly(values)
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


@njit(**PART)
def _bin_at(bits: Any, shift: Any, place: int) -> tuple[int, int]:
    """Bin of the number that would be at a place when sorted, and how many are in lower bins."""
    counts = np.zeros(_BINS, np.int32)
    for k in range(bits.size):
        counts[bits[k] >> shift & np.uint32(_BINS - 1)] += 1
    smaller, at = 0, 0
    while smaller + counts[at] <= place:
        smaller += counts[at]
        at += 1
    return at, smaller


@njit(**PART)
def _keep_bin(bits: Any, shift: Any, at: int, kept: Any) -> int:
    """Copy the numbers of one bin to the beginning of (N + 1,) ``kept``; return how many."""
    found = 0
    for k in range(bits.size):
        number = bits[k]
        kept[found] = number
        found += (number >> shift & np.uint32(_BINS - 1)) == np.uint32(at)
    return found


@njit(**ROW)
def _next_above(bits: Any, low: Any) -> tuple[Any, Any]:
    """Count the numbers up to ``low``, and find the least of the others."""
    count, high = np.int32(0), np.uint32(0xFFFFFFFF)
    for k in range(bits.size):
        above = bits[k] > low
        count += not above
        high = min(high, bits[k] if above else np.uint32(0xFFFFFFFF))
    return count, high


@njit(**LOOP)
def quantile_of(values: Any, share: float) -> Any:
    """Quantile of (N,) float32 values, none below 0, interpolated linearly."""
    if not values.size:
        return np.nan
    place = share * (values.size - 1)
    below = int(place)
    bits = values.view(np.uint32)
    near, left, at_place = np.empty(values.size + 1, np.uint32), bits, below
    for shift in _SHIFTS:
        if left.size > _FEW:
            at, smaller = _bin_at(left, np.uint32(shift), at_place)
            found = _keep_bin(left, np.uint32(shift), at, near)
            left, at_place = near[:found], at_place - smaller
    few = left.copy()
    _move_least(few, 0, at_place)
    ends = np.empty(2, np.uint32)
    ends[:] = few[at_place]
    if place > below:
        up_to, high = _next_above(bits, few[at_place])
        ends[1] = ends[0] if up_to > below + 1 else high
    numbers = ends.view(np.float32)
    low = np.float64(numbers[0])
    return low + (place - below) * (np.float64(numbers[1]) - low)
