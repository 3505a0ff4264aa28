"""Kernel of :mod:`tactile_core.algorithms.markers.spots`: the moments of connected spots.

Spots are numbered as in OpenCV: in the order in which a scan by blocks of 2 × 2 pixels meets them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float64, UInt8
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART


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
def _moments(labels: Any, weight: UInt8, label: int, box: Any, sums: Float64) -> None:
    left, top, right, bottom = box
    for y in range(top, bottom):
        row, weights = labels[y, left:right], weight[y, left:right]
        total = first = second = np.int64(0)
        for j in range(row.size):
            if row[j] == label:
                w = np.int64(weights[j])
                total += w
                first += w * j
                second += w * j * j
        wx = first + total * left
        sums[0] += total
        sums[1] += wx
        sums[2] += total * y
        sums[3] += second + left * (first + wx)
        sums[4] += wx * y
        sums[5] += total * y * y


@njit(**PART)
def _painted(dark: UInt8, rim: int, labels: Any) -> tuple[Any, Any]:
    """Number spots and their rims in ``labels``; return their boxes and the borders they touch."""
    rows, columns = dark.shape
    runs = np.empty((rows * ((columns + 1) // 2), 3), np.int32)
    parent = np.empty(len(runs), np.int32)
    count = _runs(dark, runs, parent)
    numbers, spots = _numbers(runs, parent, count, columns)
    truncated = np.zeros((spots, 4), np.bool_)
    boxes = np.empty((spots, 4), np.int64)
    boxes[:, :2] = rows + columns
    boxes[:, 2:] = 0
    for run in range(count):
        y, first, end = runs[run]
        label = numbers[run]
        left, right = max(first - rim, 0), min(end + rim, columns)
        top, bottom = max(y - rim, 0), min(y + rim + 1, rows)
        for i in range(top, bottom):
            around = labels[i, left:right]
            for j in range(around.size):
                if around[j] < label:
                    around[j] = label
        box, cut = boxes[label - 1], truncated[label - 1]
        box[0], box[1] = min(box[0], left), min(box[1], top)
        box[2], box[3] = max(box[2], right), max(box[3], bottom)
        cut[0] |= first == 0
        cut[1] |= y == 0
        cut[2] |= end == columns
        cut[3] |= y == rows - 1
    return boxes, truncated


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
    mass, centres, orientation, sigma, peak, truncated
        The fields of :class:`tactile_core.algorithms.markers.spots.Spots`.
    """
    labels = np.zeros(dark.shape, np.int32)
    boxes, truncated = _painted(dark, rim, labels)
    count = len(boxes)
    mass, orientation = np.empty((2, count))
    centres, sigma = np.empty((2, count, 2))
    peak = np.empty(count, np.uint8)
    sums = np.empty(6)
    kept = 0
    for k in range(count):
        sums[:] = 0
        _moments(labels, weight, k + 1, boxes[k], sums)
        total = max(sums[0], 1e-9)
        x, y = sums[1] / total, sums[2] / total
        top = peaks[int(np.rint(y)), int(np.rint(x))]
        if top <= faintest:
            continue
        xx, xy, yy = sums[3] / total - x * x, sums[4] / total - x * y, sums[5] / total - y * y
        mean, half_difference = (xx + yy) / 2 + pixel_variance, np.hypot((xx - yy) / 2, xy)
        mass[kept], peak[kept] = total, top
        centres[kept, 0], centres[kept, 1] = x, y
        orientation[kept] = np.arctan2(2 * xy, xx - yy) / 2
        sigma[kept, 0] = np.sqrt(mean + half_difference)
        sigma[kept, 1] = np.sqrt(max(mean - half_difference, pixel_variance))
        for side in range(4):
            truncated[kept, side] = truncated[k, side]
        kept += 1
    return (
        mass[:kept],
        centres[:kept],
        orientation[:kept],
        sigma[:kept],
        peak[:kept],
        truncated[:kept],
    )
