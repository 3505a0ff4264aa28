"""Kernels of the imprint: its pattern in a warped frame, its moments, and the fit of its motion.

The channels of a pattern are separate rows, (h, K, w), so that loops over rows are vectorised.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.edges import reflected
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import add_row, copy_row, set_row, sum_of_two

_ZERO, _ONE = np.float32(0), np.float32(1)


@njit(inline="always")
def _quarter(a: Any, b: Any, c: Any, d: Any) -> Any:
    total = np.uint16(a) + np.uint16(b) + np.uint16(c) + np.uint16(d)
    return (total + np.uint16(2)) // np.uint16(4)


@njit(**EXACT_ROW)
def _halved_row(upper: Any, lower: Any, out: Any) -> None:
    for j in range(out.size // 3):
        k = 6 * j
        out[3 * j] = _quarter(upper[k], upper[k + 3], lower[k], lower[k + 3])
        out[3 * j + 1] = _quarter(upper[k + 1], upper[k + 4], lower[k + 1], lower[k + 4])
        out[3 * j + 2] = _quarter(upper[k + 2], upper[k + 5], lower[k + 2], lower[k + 5])


@njit(**EXACT_ROW)
def _opaque_row(row: Any, out: Any) -> None:
    for j in range(out.size // 4):
        out[4 * j] = row[3 * j]
        out[4 * j + 1] = row[3 * j + 1]
        out[4 * j + 2] = row[3 * j + 2]
        out[4 * j + 3] = 1


@njit(**LOOP)
def halved(pixels: Any, halvings: int, out: Any) -> None:
    """Copy a colour image, or halve it; bytes are rounded as OpenCV does.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
    halvings : int
        0, or 1 where that divides both sides exactly.
    out : (h, w, 4) float32
        Overwritten by the result, and a last channel of 1: OpenCV warps four channels faster.
    """
    height, width = out.shape[:2]
    rows, large = out.reshape(height, 4 * width), pixels.reshape(len(pixels), -1)
    half = np.empty(3 * width, np.uint8)
    for i in range(height):
        if halvings == 0:
            _opaque_row(large[i], rows[i])
        else:
            _halved_row(large[2 * i], large[2 * i + 1], half)
            _opaque_row(half, rows[i])


@njit(**ROW)
def _seen_row(x: Any, y: Any, hidden: Any, last: tuple[Any, Any], seen: Any) -> None:
    right, bottom = last
    for j in range(x.size):
        within = (x[j] >= 0) & (y[j] >= 0) & (x[j] <= right) & (y[j] <= bottom)
        seen[j] = _ONE if within & (not hidden[j]) else _ZERO


@njit(**ROW)
def _separate(warped: Any, weight: Any, a: Any, b: Any, c: Any, d: Any) -> None:
    """Separate all channels of one row; 0 where the weight is.

    The compiler rearranges whole pixels; a part of their channels it collects one by one.
    """
    for j in range(weight.size):
        a[j] = warped[4 * j] * weight[j]
        b[j] = warped[4 * j + 1] * weight[j]
        c[j] = warped[4 * j + 2] * weight[j]
        d[j] = warped[4 * j + 3] * weight[j]


@njit(**PART)
def _mirror_ends(line: Any, reach: int) -> None:
    last = line.size - reach - 1
    for i in range(1, reach + 1):
        line[reach - i] = line[reach + i]
        line[last + i] = line[last - i]


@njit(**ROW)
def _sum_of_three(a: Any, b: Any, c: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = a[j] + b[j] + c[j]


@njit(**ROW)
def _sum_of_four(a: Any, b: Any, c: Any, d: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = a[j] + b[j] + c[j] + d[j]


@njit(**PART)
def _box_row(row: Any, side: int, spare: tuple[Any, Any], out: Any) -> None:
    """Sum each value and the ``side`` - 1 after it; ``side`` is odd. The last sums are undefined.

    Sums of 1, 4, 16 … values are each made of four of the former, and joined.
    """
    count = row.size - side + 1
    of, first, second = row, spare[0], spare[1]
    if side % 4 == 3:
        _sum_of_three(row, row[1:], row[2:], out[:count])
    elif side == 1:
        copy_row(row, out)
    step, joined = 4, side % 4
    while step <= side:
        end, part = row.size - step + 1, step // 4
        _sum_of_four(of, of[part:], of[2 * part :], of[3 * part :], first[:end])
        of, first, second = first, second, first
        for _ in range(side // step % 4):
            if joined == 1:
                sum_of_two(row, of[1:], out[:count])
            else:
                add_row(of[joined:], out[:count])
            joined += step
        step *= 4


@njit(**ROW)
def _slide(new: Any, old: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] += new[j] - old[j]


@njit(**PART)
def _slide_down(recent: Any, i: int, count: int, reach: int, out: Any) -> None:
    """Sums over 2 reach + 1 of ``count`` rows around row i, from those around the row above."""
    kept = len(recent)
    if i:
        new, old = reflected(i + reach, count), reflected(i - 1 - reach, count)
        _slide(recent[new % kept], recent[old % kept], out)
        return
    set_row(out, _ZERO)
    for above in range(-reach, reach + 1):
        add_row(recent[reflected(above, count) % kept], out)


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

    Each row passes through all filters before the next one; only the rows that the filters reach
    are kept, so that they stay in the processor's cache.

    Parameters
    ----------
    warped : (h, w, 4) float32
        Three channels, and one that is 1.
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
    kept, kept_near = 2 * reach + 2, 2 * grain + 2
    visible, sums = np.empty((kept, 4, n), np.float32), np.empty((kept, 4 * n), np.float32)
    relative, near = np.empty((3, m), np.float32), np.empty((kept_near, 3 * m), np.float32)
    spare = np.empty(4 * n, np.float32), np.empty(4 * n, np.float32)
    total, total_near = np.empty(4 * n, np.float32), np.empty(3 * m, np.float32)
    least = np.float32(1e-6 * (2 * reach + 1) ** 2)
    per_pixel = np.float32(1 / (2 * grain + 1) ** 2)
    for step in range(height + reach + grain):
        i = step
        if i < height:
            row, weight = visible[i % kept], seen[i]
            _seen_row(x[i], y[i], hidden[i], last, weight)
            a, b, c, ones = row[0, reach:], row[1, reach:], row[2, reach:], row[3, reach:]
            _separate(warped[i].reshape(-1), weight, a, b, c, ones)
            for k in range(4):
                _mirror_ends(row[k], reach)
            _box_row(row.reshape(-1), 2 * reach + 1, spare, sums[i % kept])
        i -= reach
        if 0 <= i < height:
            _slide_down(sums, i, height, reach, total)
            for k in range(3):
                values, out = visible[i % kept, k, reach:], relative[k]
                _relative(values, total[k * n :], total[3 * n :], seen[i], least, out[grain:])
                _mirror_ends(out, grain)
            _box_row(relative.reshape(-1), 2 * grain + 1, spare, near[i % kept_near])
        i -= grain
        if i >= 0:
            _slide_down(near, i, height, grain, total_near)
            for k in range(3):
                _scaled_product(total_near[k * m :], seen[i], per_pixel, pattern[i, k])


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
    columns = np.empty(width, np.float32)
    for j in range(width):
        columns[j] = j - x0
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
def _lowest_product(before: tuple[Any, Any, Any], now: tuple[Any, Any, Any], out: Any) -> None:
    a, b, c = before
    d, e, f = now
    for j in range(out.size):
        out[j] = min(a[j] * d[j], min(b[j] * e[j], c[j] * f[j]))


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


@njit(**PART)
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
    sums = np.zeros(13)
    lowest = np.empty(width, np.float32)
    # no weight at the ends of the channels, where one is next to another
    weights = np.zeros((channels, width), np.float32)
    columns = np.empty((channels, width), np.float32)
    for j in range(width):
        for k in range(channels):
            columns[k, j] = j - centre[0]
    weight, column = weights.reshape(-1)[1:-1], columns.reshape(-1)[1:-1]
    before, now = before.reshape(height, -1), now.reshape(height, -1)
    for i in range(1, height - 1, 2):
        of_before = seen_before[i - 1], seen_before[i], seen_before[i + 1]
        _lowest_product(of_before, (seen_now[i - 1], seen_now[i], seen_now[i + 1]), lowest)
        _lowest(lowest[:-2], lowest[1:-1], lowest[2:], weights[0, 1:-1])
        for k in range(1, channels):
            copy_row(weights[0], weights[k])
        row = np.float32(i - centre[1])
        found = _fit_row(_around(before, i), _around(now, i), weight, column, row)
        for k in range(12):
            sums[k] += found[k]
        seen = _ZERO
        for j in range(width):
            seen += weights[0, j]
        sums[12] += channels * seen
    return sums
