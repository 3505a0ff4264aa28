"""Kernels of the imprint: its pattern in a warped frame, its moments, and the fit of its motion.

The channels of a pattern are separate rows, (h, K, w), so that loops over rows are vectorised.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, ROW

_ZERO, _ONE = np.float32(0), np.float32(1)


@njit(**LOOP)
def _reflected(index: int, count: int) -> int:
    """Mirror an index outside a line about its last pixel, as OpenCV's filters do."""
    while count > 1 and (index < 0 or index >= count):
        index = -index if index < 0 else 2 * (count - 1) - index
    return index if count > 1 else 0


@njit(**ROW)
def _visible_row(
    warped: Any,
    x: Any,
    y: Any,
    hidden: Any,
    last: tuple[Any, Any],
    lines: tuple[Any, Any, Any],
    seen: Any,
) -> None:
    """Separate the channels of one row, and their weight; all 0 where hidden or out of view."""
    right, bottom = last
    a, b, c = lines
    for j in range(x.size):
        within = (x[j] >= 0) & (y[j] >= 0) & (x[j] <= right) & (y[j] <= bottom)
        weight = _ONE if within & (not hidden[j]) else _ZERO
        a[j] = warped[j, 0] * weight
        b[j] = warped[j, 1] * weight
        c[j] = warped[j, 2] * weight
        seen[j] = weight


@njit(**LOOP)
def _mirror_ends(line: Any, reach: int) -> None:
    last = line.size - reach - 1
    for i in range(1, reach + 1):
        line[reach - i] = line[reach + i]
        line[last + i] = line[last - i]


@njit(**ROW)
def _sum(rows: Any, others: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = rows[j] + others[j]


@njit(**ROW)
def _add(row: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] += row[j]


@njit(**LOOP)
def _box_row(row: Any, side: int, spare: tuple[Any, Any], out: Any) -> None:
    """Sum each value and the ``side`` - 1 after it.

    Sums of 1, 2, 4, 8 … values are each made of two of the former, and joined.
    """
    of, first, second = row, spare[0], spare[1]
    out[:] = _ZERO
    step, joined = 1, 0
    while step <= side:
        if side & step:
            _add(of[joined:], out[: out.size - joined])
            joined += step
        if 2 * step <= side:
            end = out.size - step
            _sum(of[:end], of[step:], first[:end])
            of, first, second = first, second, first
        step *= 2


@njit(**ROW)
def _slide(new: Any, old: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] += new[j] - old[j]


@njit(**LOOP)
def _slide_down(sums: Any, i: int, reach: int, out: Any) -> None:
    """Sums over 2 reach + 1 rows around row i, from those around the row above."""
    count = len(sums)
    if i:
        _slide(sums[_reflected(i + reach, count)], sums[_reflected(i - 1 - reach, count)], out)
        return
    out[:] = _ZERO
    for above in range(-reach, reach + 1):
        _add(sums[_reflected(above, count)], out)


@njit(**ROW)
def _relative(values: Any, total: Any, around: Any, weight: Any, least: Any, out: Any) -> None:
    for j in range(weight.size):
        share = max(around[j], least)
        out[j] = values[j] * share / max(total[j], share) - weight[j]


@njit(**ROW)
def _scaled_product(first: Any, second: Any, scale: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = first[j] * second[j] * scale


@njit(**LOOP)
def pattern_of(
    warped: Any,
    x: Any,
    y: Any,
    hidden: Any,
    reaches: tuple[int, int],
    pattern: Any,
    seen: Any,
) -> None:
    """Remove structure that is coarser than the marker pitch from a warped frame.

    Parameters
    ----------
    warped : (h, w, 4) float32
        Three channels, and one that is ignored.
    x, y : (h, w) float32
        Where each pixel was sampled.
    hidden : (h, w) bool
    reaches : (int, int)
        Half sides of the box filters of the background, and against grain; smaller than the view.
    pattern : (h, 3, w) float32
        Overwritten by the intensity relative to the background, minus 1; 0 where it is hidden.
    seen : (h, w) float32
        Overwritten by 1 where the surface is visible, else 0.
    """
    height, width = hidden.shape
    last = np.float32(width - 1), np.float32(height - 1)
    reach, grain = reaches
    n, m = width + 2 * reach, width + 2 * grain
    visible, sums = np.empty((height, 4, n), np.float32), np.empty((height, 4 * n), np.float32)
    first, second = np.empty(4 * n, np.float32), np.empty(4 * n, np.float32)
    total = np.empty(4 * n, np.float32)
    for i in range(height):
        lines = (visible[i, 0, reach:], visible[i, 1, reach:], visible[i, 2, reach:])
        _visible_row(warped[i], x[i], y[i], hidden[i], last, lines, seen[i])
        visible[i, 3, reach : reach + width] = seen[i]
        for k in range(4):
            _mirror_ends(visible[i, k], reach)
        _box_row(visible[i].reshape(-1), 2 * reach + 1, (first, second), sums[i])
    relative, near = np.empty((height, 3, m), np.float32), np.empty((height, 3 * m), np.float32)
    least = np.float32(1e-6 * (2 * reach + 1) ** 2)
    for i in range(height):
        _slide_down(sums, i, reach, total)
        for k in range(3):
            values, out = visible[i, k, reach:], relative[i, k]
            _relative(values, total[k * n :], total[3 * n :], seen[i], least, out[grain:])
            _mirror_ends(out, grain)
        _box_row(relative[i].reshape(-1), 2 * grain + 1, (first, second), near[i])
    per_pixel, total = np.float32(1 / (2 * grain + 1) ** 2), total[: 3 * m]
    for i in range(height):
        _slide_down(near, i, grain, total)
        for k in range(3):
            _scaled_product(total[k * m :], seen[i], per_pixel, pattern[i, k])


@njit(**ROW)
def _moments_of_row(row: Any, x: Any) -> tuple[Any, Any, Any]:
    one = first = second = _ZERO
    for j in range(row.size):
        square = row[j] * row[j]
        one += square
        first += square * x[j]
        second += square * x[j] * x[j]
    return one, first, second


@njit(**LOOP)
def energy_moments(pattern: Any) -> tuple[float, float, float, float]:
    """Energy of a pattern (h, K, w), x and y of its centroid, and its squared RMS radius."""
    height, channels, width = pattern.shape
    x0, y0 = (width - 1) / 2, (height - 1) / 2
    columns = (np.arange(width) - x0).astype(np.float32)
    energy = x = y = square = 0.0
    for i in range(height):
        for k in range(channels):
            one, first, second = _moments_of_row(pattern[i, k], columns)
            energy += one
            x += first
            y += one * (i - y0)
            square += second + one * (i - y0) ** 2
    total = max(energy, 1e-12)
    x, y = x / total, y / total
    share = energy / total
    return energy, x + share * x0, y + share * y0, max(square / total - x * x - y * y, 0.0)


@njit(**ROW)
def _lowest(first: Any, second: Any, third: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = min(first[j], min(second[j], third[j]))


@njit(**ROW)
def _fit_row(
    before: tuple[Any, Any, Any, Any, Any],
    now: tuple[Any, Any, Any, Any, Any],
    weight: Any,
    columns: Any,
    row: Any,
) -> tuple[Any, ...]:
    """Sums of one row; both patterns above, left, here, right and below."""
    above, left, here, right, below = before
    now_above, now_left, now_here, now_right, now_below = now
    xx = xy = yy = xt = yt = tt = xc = yc = tc = cc = mm = cm = _ZERO
    quarter, half = np.float32(-0.25), np.float32(0.5)
    for j in range(weight.size):
        w = weight[j]
        x = (right[j] + now_right[j] - left[j] - now_left[j]) * quarter * w
        y = (below[j] + now_below[j] - above[j] - now_above[j]) * quarter * w
        t = y * columns[j] - x * row
        c = (now_here[j] - here[j]) * w
        m = (now_here[j] + here[j]) * half * w
        xx += x * x
        xy += x * y
        yy += y * y
        xt += x * t
        yt += y * t
        tt += t * t
        xc += x * c
        yc += y * c
        tc += t * c
        cc += c * c
        mm += m * m
        cm += c * m
    return xx, xy, yy, xt, yt, tt, xc, yc, tc, cc, mm, cm


@njit(**LOOP)
def _around(rows: Any, i: int) -> tuple[Any, Any, Any, Any, Any]:
    """The rows above, left of, at, right of and below the inner pixels of a row."""
    return rows[i - 1, 1:-1], rows[i, :-2], rows[i, 1:-1], rows[i, 2:], rows[i + 1, 1:-1]


@njit(**LOOP)
def fit_sums(
    before: Any, now: Any, seen_before: Any, seen_now: Any, centre: tuple[float, float]
) -> Any:
    """Sums of the least-squares fit of a rigid motion to the change of every second row.

    Parameters
    ----------
    before, now : (h, K, w) float32
    seen_before, seen_now : (h, w) float32
    centre : (x, y)

    Returns
    -------
    (13,) float64
        Products of the slopes in x, y and rotation (xx, xy, yy, xt, yt, tt), their products with
        the change, squares of the change and of the mean pattern, their product, and the number of
        values.
    """
    height, channels, width = before.shape
    sums, both = np.zeros(13), np.empty((3, width), np.float32)
    lowest = np.empty(width, np.float32)
    # no weight at the ends of the channels, where one is next to another
    weights = np.zeros((channels, width), np.float32)
    columns = np.empty((channels, width), np.float32)
    columns[:] = (np.arange(width) - centre[0]).astype(np.float32)
    weight, column = weights.reshape(-1)[1:-1], columns.reshape(-1)[1:-1]
    before, now = before.reshape(height, -1), now.reshape(height, -1)
    for i in range(1, height - 1, 2):
        for k in range(3):
            _scaled_product(seen_before[i + k - 1], seen_now[i + k - 1], _ONE, both[k])
        _lowest(both[0], both[1], both[2], lowest)
        for k in range(channels):
            _lowest(lowest[:-2], lowest[1:-1], lowest[2:], weights[k, 1:-1])
        row = np.float32(i - centre[1])
        found = _fit_row(_around(before, i), _around(now, i), weight, column, row)
        for k in range(12):
            sums[k] += found[k]
        sums[12] += channels * weights[0].sum()
    return sums
