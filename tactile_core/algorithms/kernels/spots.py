"""Kernel of :mod:`tactile_core.algorithms.markers.spots`: the moments of connected spots.

Spots are numbered as in OpenCV: in the order in which a scan by blocks of 2 × 2 pixels meets them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import copy_row

_LANES = 16
"""Pixels that are summed together."""


@njit(**EXACT_ROW)
def _brightest(row: UInt8) -> Any:
    most = np.uint8(0)
    for j in range(row.size):
        most = max(most, row[j])
    return most


@njit(**PART)
def _root(parent: Any, run: int) -> int:
    while parent[run] != run:
        parent[run] = parent[parent[run]]
        run = parent[run]
    return run


@njit(**PART)
def _runs(dark: UInt8, runs: Any, parent: Any) -> int:
    """Find runs (row, first, end) of dark pixels and join those that touch; return their number."""
    count, before, above = 0, 0, -2
    for i in range(len(dark)):
        row = dark[i]
        if _brightest(row) == 0:
            continue
        start = count
        touching = before if above == i - 1 else start
        j = 0
        while j < row.size:
            if row[j] == 0:
                j += 1
                continue
            first = j
            while j < row.size and row[j] != 0:
                j += 1
            runs[count, 0], runs[count, 1], runs[count, 2] = i, first, j
            parent[count] = count
            while touching < start and runs[touching, 2] < first:
                touching += 1
            other = touching
            while other < start and runs[other, 1] <= j:
                one, two = _root(parent, count), _root(parent, other)
                parent[max(one, two)] = min(one, two)
                other += 1
            count += 1
        before, above = start, i
    return count


@njit(**LOOP)
def joined_runs(dark: UInt8) -> tuple[Any, Any]:
    """Find the runs of dark pixels in each row, and the first run of the spot of each.

    Parameters
    ----------
    dark : (h, w) uint8

    Returns
    -------
    runs : (N, 3) int32
        Row, first column, and the column after the last.
    root : (N,) int32
        Number of the first run to which it is connected, also diagonally.
    """
    rows, columns = dark.shape
    runs = np.empty((rows * ((columns + 1) // 2), 3), np.int32)
    parent = np.empty(len(runs), np.int32)
    count = _runs(dark, runs, parent)
    for run in range(count):
        parent[run] = _root(parent, run)
    return runs[:count], parent[:count]


@njit(**PART)
def _numbers(runs: Any, parent: Any, count: int, columns: int) -> tuple[Any, int]:
    """Number the spots from 1 on in the order of their first blocks; return each run's number."""
    numbers = np.zeros(count, np.int32)
    first = np.empty(count, np.int64)
    roots = np.empty(count, np.int64)
    spots = 0
    for run in range(count):
        parent[run] = root = _root(parent, run)
        block = runs[run, 0] // 2 * columns + runs[run, 1] // 2
        if root == run:
            first[run] = block
            roots[spots] = run
            spots += 1
        else:
            first[root] = min(first[root], block)
    for k in range(1, spots):  # nearly sorted
        root, place = roots[k], k
        while place > 0 and first[roots[place - 1]] > first[root]:
            roots[place] = roots[place - 1]
            place -= 1
        roots[place] = root
    for k in range(spots):
        numbers[roots[k]] = k + 1
    for run in range(count):
        numbers[run] = numbers[parent[run]]
    return numbers, spots


@njit(**PART)
def _grouped(runs: Any, numbers: Any, spots: int) -> tuple[Any, Any]:
    """Runs in the order of their spots, and where the runs of each spot end in that order."""
    ends = np.zeros(spots + 1, np.int64)
    for run in range(numbers.size):
        ends[numbers[run]] += 1
    for k in range(spots):
        ends[k + 1] += ends[k]
    free = ends.copy()
    grouped = np.empty((numbers.size, 3), np.int32)
    for run in range(numbers.size):
        k = numbers[run] - 1
        for side in range(3):
            grouped[free[k], side] = runs[run, side]
        free[k] += 1
    return grouped, ends


@njit(**ROW)
def _take(part: UInt8, count: int) -> tuple[Any, Any, Any]:
    """Sums of w, w j and w j² of some pixels, which are set to 0, so that they count once.

    The sums are exact, because they are whole and small.
    """
    total = first = second = np.float32(0)
    for j in range(_LANES):
        w = np.float32(part[j]) if j < count else np.float32(0)
        total += w
        first += w * np.float32(j)
        second += w * np.float32(j * j)
        part[j] = np.uint8(0) if j < count else part[j]
    return total, first, second


@njit(**PART)
def _add_rows(flat: UInt8, columns: int, top: int, low: Any, high: Any, moments: Any) -> None:
    """Add the moments of the pixels from ``low`` to ``high`` in each row from ``top`` on."""
    w = wx = wy = xx = xy = yy = 0.0
    for i in range(low.size):
        y = np.float64(top + i)
        for x in range(low[i], high[i], _LANES):
            sums = _take(flat[(top + i) * columns + x :], high[i] - x)
            total, first, second = np.float64(sums[0]), np.float64(sums[1]), np.float64(sums[2])
            along = first + total * x
            w += total
            wx += along
            wy += total * y
            xx += second + x * (first + along)
            xy += along * y
            yy += total * y * y
    moments[0] += w
    moments[1] += wx
    moments[2] += wy
    moments[3] += xx
    moments[4] += xy
    moments[5] += yy


@njit(**PART)
def _add_spot(runs: Any, rim: int, flat: UInt8, shape: Any, ends: Any, moments: Any) -> None:
    """Add the moments of one spot and its rim, whose pixels are set to 0."""
    rows, columns = shape
    low, high = ends
    top = runs[0, 0] - rim
    height = runs[len(runs) - 1, 0] + rim + 1 - top
    for i in range(height):
        low[i], high[i] = columns, 0
    for run in range(len(runs)):
        first, end = max(runs[run, 1] - rim, 0), min(runs[run, 2] + rim, columns)
        begin = runs[run, 0] - rim - top
        for i in range(begin, begin + 2 * rim + 1):
            if low[i] < high[i] and (first > high[i] or end < low[i]):
                if 0 <= top + i < rows:
                    _add_rows(flat, columns, top + i, low[i : i + 1], high[i : i + 1], moments)
                low[i], high[i] = first, end
            low[i], high[i] = min(low[i], first), max(high[i], end)
    above, until = max(-top, 0), min(height, rows - top)
    _add_rows(flat, columns, top + above, low[above:until], high[above:until], moments)


@njit(**LOOP)
def measured_spots(
    dark: UInt8, weight: UInt8, peaks: UInt8, faintest: float, rim: int, pixel_variance: float
) -> tuple[Any, Any, Any, Any, Any, Any]:
    """Measure each connected spot, including a rim that contains its blurred edge.

    Parameters
    ----------
    dark, weight, peaks, faintest, rim
        See :func:`tactile_core.algorithms.markers.spots.measured_spots`.
    pixel_variance : float
        Variance of the position within one pixel, px².

    Returns
    -------
    mass, centres, slant, sigma, peak, truncated
        The fields of :class:`tactile_core.algorithms.markers.spots.Spots`.
    """
    rows, columns = dark.shape
    runs, parent = joined_runs(dark)
    numbers, count = _numbers(runs, parent, len(runs), columns)
    grouped, places = _grouped(runs, numbers, count)
    flat = np.zeros(weight.size + _LANES, np.uint8)
    for i in range(rows):
        copy_row(weight[i], flat[i * columns :])
    sums = np.zeros((count, 6))
    ends = np.empty((2, rows + 2 * rim), np.int64)
    # where rims overlap, a pixel belongs to the last spot
    for k in range(count - 1, -1, -1):
        of_spot = grouped[places[k] : places[k + 1]]
        _add_spot(of_spot, rim, flat, dark.shape, (ends[0], ends[1]), sums[k])
    truncated = np.zeros((count, 4), np.bool_)
    for run in range(len(runs)):
        y, first, end = runs[run]
        sides = first == 0, y == 0, end == columns, y == rows - 1
        if sides[0] or sides[1] or sides[2] or sides[3]:
            for side in range(4):
                truncated[numbers[run] - 1, side] |= sides[side]
    mass = np.empty(count)
    centres, slant, sigma = np.empty((3, count, 2))
    peak = np.empty(count, np.uint8)
    kept = 0
    for k in range(count):
        total = max(sums[k, 0], 1e-9)
        x, y = sums[k, 1] / total, sums[k, 2] / total
        top = peaks[int(np.rint(y)), int(np.rint(x))]
        if top <= faintest:
            continue
        xx, xy = sums[k, 3] / total - x * x, sums[k, 4] / total - x * y
        yy = sums[k, 5] / total - y * y
        slant[kept, 0], slant[kept, 1] = xx - yy, 2 * xy
        mean = (xx + yy) / 2 + pixel_variance
        half_difference = np.sqrt((xx - yy) * (xx - yy) + 4 * xy * xy) / 2
        mass[kept], peak[kept] = total, top
        centres[kept, 0], centres[kept, 1] = x, y
        sigma[kept, 0] = np.sqrt(mean + half_difference)
        sigma[kept, 1] = np.sqrt(max(mean - half_difference, pixel_variance))
        for side in range(4):
            truncated[kept, side] = truncated[k, side]
        kept += 1
    return (
        mass[:kept],
        centres[:kept],
        slant[:kept],
        sigma[:kept],
        peak[:kept],
        truncated[:kept],
    )
