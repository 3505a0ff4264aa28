"""Kernel of :func:`tactile_core.algorithms.slip.touched.contact_within_ring`.

Masks are rows of 64-bit words, so that a disc is dilated along a row by shifts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART
from tactile_core.algorithms.kernels.spots import joined_runs

_ONE, _LAST = np.uint64(1), np.uint64(63)
_X = (1, 1, 0, -1, -1, -1, 0, 1)
"""Columns to the right of a pixel of its neighbours, anticlockwise from the one to the right."""

_Y = (0, -1, -1, -1, 0, 1, 1, 1)
"""Rows below a pixel of the same neighbours."""

_NONE = 1 << 30
"""First column of a row without any."""


@njit(**PART)
def _widen(row: Any, wide: Any) -> None:
    """Dilate the bits of a row by one to both sides."""
    for k in range(row.size):
        bits = row[k] | (row[k] << _ONE) | (row[k] >> _ONE)
        if k > 0:
            bits |= row[k - 1] >> _LAST
        if k < row.size - 1:
            bits |= row[k + 1] << _LAST
        wide[k] = bits


@njit(**PART)
def _dilated(bits: Any, halves: Any) -> Any:
    """Dilate by a symmetric shape, whose rows have these half widths, (2 r + 1,)."""
    rows, words = bits.shape
    out, reach = np.zeros((rows, words), np.uint64), halves.size // 2
    one, other = np.empty(words, np.uint64), np.empty(words, np.uint64)
    for i in range(rows):
        row = bits[i]
        for half in range(reach + 1):
            for k in range(halves.size):
                y = i + k - reach
                if halves[k] == half and 0 <= y < rows:
                    for word in range(words):
                        out[y, word] |= row[word]
            wide = one if half & 1 else other
            _widen(row, wide)
            row = wide
    return out


@njit(**PART)
def _closed(steep: Any, limit: Any, disc: Any) -> Any:
    """Close the mask of what is steep by a disc."""
    height, width = steep.shape
    gap = disc.size // 2
    bits = np.zeros((height + 2 * gap, (width + 2 * gap + 63) // 64), np.uint64)
    for i in range(height):
        for j in range(width):
            if steep[i, j] > limit:
                bits[i + gap, (j + gap) >> 6] |= _ONE << np.uint64((j + gap) & 63)
    bits = ~_dilated(~_dilated(bits, disc), disc)
    closed = np.empty(steep.shape, np.uint8)
    for i in range(height):
        for j in range(width):
            closed[i, j] = (bits[i + gap, (j + gap) >> 6] >> np.uint64((j + gap) & 63)) & _ONE
    return closed


@njit(**PART)
def _is_set(mask: Any, x: int, y: int) -> Any:
    return 0 <= y < mask.shape[0] and 0 <= x < mask.shape[1] and mask[y, x] != 0


@njit(**PART)
def _outer_area(mask: Any, x: int, y: int) -> float:
    """Area of the polygon through the outer border of a part, whose first pixel is given [1]_.

    References
    ----------
    .. [1] S. Suzuki and K. Abe, "Topological structural analysis of digitized binary images by
       border following", Computer Vision, Graphics, and Image Processing 30(1), 1985.
    """
    way = 3
    while way >= 0 and not _is_set(mask, x + _X[way], y + _Y[way]):
        way -= 1
    if way < 0:
        for way in range(7, 4, -1):
            if _is_set(mask, x + _X[way], y + _Y[way]):
                break
        else:
            return 0.0
    last_x, last_y = x + _X[way], y + _Y[way]
    at_x, at_y, twice = x, y, 0
    while True:
        way = (way + 1) & 7
        while not _is_set(mask, at_x + _X[way], at_y + _Y[way]):
            way = (way + 1) & 7
        next_x, next_y = at_x + _X[way], at_y + _Y[way]
        twice += at_x * next_y - next_x * at_y
        if next_x == x and next_y == y and at_x == last_x and at_y == last_y:
            return abs(twice) / 2
        at_x, at_y, way = next_x, next_y, (way + 4) & 7


@njit(**PART)
def _draw_line(x: int, y: int, to_x: int, to_y: int, first: Any, last: Any) -> None:
    """Extend the rows, from ``first`` to ``last`` column, to the pixels of a line [1]_.

    References
    ----------
    .. [1] J. E. Bresenham, "Algorithm for computer control of a digital plotter", IBM Systems
       Journal 4(1), 1965.
    """
    if to_x < x:
        x, y, to_x, to_y = to_x, to_y, x, y
    right, down = to_x - x, abs(to_y - y)
    step = 1 if to_y >= y else -1
    far, near = max(right, down), min(right, down)
    error = far - 2 * near
    for _ in range(far + 1):
        first[y], last[y] = min(first[y], x), max(last[y], x)
        beside = error < 0
        error += 2 * far * beside - 2 * near
        x += right >= down or beside
        y += step * (down > right or beside)


@njit(**PART)
def _draw_chain(columns: Any, side: int, first: Any, last: Any) -> None:
    """Draw one side of a convex hull; ``side`` is 1 for the left one and -1 for the right one.

    ``columns`` are those of the outermost pixels in each row, if it has any.
    """
    hull, count = np.empty(columns.size, np.int64), 0
    for y in range(columns.size):
        if not 0 <= columns[y] < _NONE:
            continue
        while count > 1:
            one, two = hull[count - 2], hull[count - 1]
            bend = (columns[two] - columns[one]) * (y - one)
            bend -= (columns[y] - columns[one]) * (two - one)
            if side * bend < 0:
                break
            count -= 1
        hull[count] = y
        count += 1
    for k in range(1, count):
        one, two = hull[k - 1], hull[k]
        _draw_line(columns[one], one, columns[two], two, first, last)


@njit(**PART)
def _fill_hull(left: Any, right: Any, bits: Any) -> None:
    """Set the bits of the convex hull of the outermost pixels in each row; forget them."""
    first, last = left.copy(), right.copy()
    _draw_chain(left, 1, first, last)
    _draw_chain(right, -1, first, last)
    for y in range(left.size):
        if last[y] >= 0:
            for x in range(first[y], last[y] + 1):
                bits[y, x >> 6] |= _ONE << np.uint64(x & 63)
        left[y], right[y] = _NONE, -1


@njit(**LOOP)
def within_ring(steep: Any, limit: Any, disc: Any, square: Any, min_area: float) -> Any:
    """Return the contact area inside the steep ring at its border.

    Parameters
    ----------
    steep : (h, w) float32
    limit : float32
        Steepness above which a point belongs to the ring.
    disc, square : (2 r + 1,) int64
        Half widths of the rows of the shapes of the closing and of the erosion.
    min_area : float
        Area below which a contour is a speck.

    Returns
    -------
    (h, w) bool
    """
    height, width = steep.shape
    closed = _closed(steep, limit, disc)
    runs, root = joined_runs(closed)
    bits = np.zeros((height, (width + 63) // 64), np.uint64)
    left, right = np.empty(height, np.int64), np.empty(height, np.int64)
    left_leaving, right_leaving = left.copy(), right.copy()
    for y in range(height):
        left[y], right[y], left_leaving[y], right_leaving[y] = _NONE, -1, _NONE, -1
    count = len(runs)
    for part in range(count):
        if root[part] != part:
            continue
        if _outer_area(closed, runs[part, 1], runs[part, 0]) < min_area:
            continue
        leaves = False
        for run in range(part, count):
            if root[run] == part:
                y, start, end = runs[run]
                leaves |= y == 0 or y == height - 1 or start == 0 or end == width
                left[y], right[y] = min(left[y], start), max(right[y], end - 1)
        if leaves:
            for y in range(height):
                left_leaving[y] = min(left_leaving[y], left[y])
                right_leaving[y] = max(right_leaving[y], right[y])
                left[y], right[y] = _NONE, -1
        else:
            _fill_hull(left, right, bits)
    # what leaves the view is one contact
    _fill_hull(left_leaving, right_leaving, bits)
    for y in range(height):
        for word in range(bits.shape[1]):
            # what is outside of the view does not erode it
            inside = min(width - 64 * word, 64)
            bits[y, word] = ~bits[y, word] & (~np.uint64(0) >> np.uint64(64 - inside))
    bits, mask = _dilated(bits, square), np.empty(steep.shape, np.bool_)
    for y in range(height):
        for x in range(width):
            mask[y, x] = not (bits[y, x >> 6] >> np.uint64(x & 63)) & _ONE
    return mask
