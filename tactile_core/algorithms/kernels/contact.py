"""Kernels of :mod:`tactile_core.algorithms.contact`: the regions in contact, and their pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.selection import quantile_of
from tactile_core.algorithms.kernels.spots import joined_runs

_NONE = np.float32(3e38)
"""A border that no height is above; finite, so that loops over rows may be reordered."""


@njit(**ROW)
def _steep_row(above: Any, left: Any, right: Any, below: Any, scale: Any, out: Any) -> None:
    for j in range(out.size):
        along, down = (right[j] - left[j]) * scale, (below[j] - above[j]) * scale
        out[j] = np.sqrt(along * along + down * down)


@njit(**PART)
def _steep_row_to_its_ends(above: Any, row: Any, below: Any, scale: Any, out: Any) -> None:
    """Slopes of a row, whose ends have none along it, because they are mirrored there."""
    out[0], out[-1] = abs(below[0] - above[0]) * scale, abs(below[-1] - above[-1]) * scale
    _steep_row(above[1:-1], row[:-2], row[2:], below[1:-1], scale, out[1:-1])


@njit(**EXACT_ROW)
def _count_above(row: Any, limit: Any) -> Any:
    count = np.int32(0)
    for j in range(row.size):
        count += row[j] > limit
    return count


@njit(**EXACT_ROW)
def _above_row(row: Any, limit: Any, out: Any) -> None:
    for j in range(row.size):
        out[j] = row[j] > limit


@njit(**ROW)
def _greatest(values: Any) -> Any:
    most = values[0]
    for j in range(values.size):
        most = max(most, values[j])
    return most


@njit(**PART)
def _height_noise(coarse: Any, step: int, sigma_per_median: float) -> float:
    """Noise of the height, from a sample of the cells below 0."""
    depth, found = np.empty(coarse.size, np.float32), 0
    for i in range(0, coarse.shape[0], step):
        for j in range(0, coarse.shape[1], step):
            if coarse[i, j] < 0:
                depth[found] = -coarse[i, j]
                found += 1
    return sigma_per_median * quantile_of(depth[:found], 0.5) if found else 0.0


@njit(**PART)
def _steepest_band(total: Any, count: Any, highest: int) -> int:
    """Band of relative depth in which the mean slope of three bands is largest."""
    mean = np.empty(total.size)
    for k in range(mean.size):
        mean[k] = total[k] / max(count[k], 1.0)
    best, most = 1, -1.0
    for k in range(1, highest + 1):
        here = mean[k]
        if k < mean.size - 1:
            here += (mean[k - 1] + mean[k + 1]) / 2
        if here > most:
            best, most = k, here
    return best


@njit(**LOOP)
def touched_regions(
    coarse: Any,
    spacing_mm: float,
    sample_step: int,
    options: tuple[float, float, float, float],
    noise: tuple[float, float, float, float, float],
    bands: tuple[int, int, float],
    border_mm: Any,
) -> Any:
    """Find the cells of each region in contact, and the depth of its border.

    Parameters
    ----------
    coarse : (h, w) float32
        Height above the rest surface, at least 2 × 2 cells.
    spacing_mm : float
        Side of a cell.
    sample_step : int
        The noise is that of every so many cells along each side.
    options : tuple of float
        ``min_indentation_mm``, ``border_fraction`` or a negative number, ``min_slope`` and the
        least area in cells, as :func:`tactile_core.algorithms.contact.contact_mask` has them.
    noise : tuple of float
        Standard deviation over the median; and ``region_sigmas``, ``detection_sigmas``,
        ``largest_noise_share`` and ``rayleigh_quartile`` of ``ContactParameters``.
    bands : (int, int, float)
        ``bands``, ``highest_band`` and ``border_ratio`` of ``ContactParameters``.
    border_mm : (h, w) float32
        Overwritten by the depth of the border of the region that each cell touches; else 3e38.

    Returns
    -------
    bool
        Whether any cell touches.
    """
    height = len(coarse)
    min_indentation_mm, border_fraction, min_slope, min_area = options
    sigma_per_median, region_sigmas, detection_sigmas, largest_noise_share, quartile = noise
    border_mm[:] = _NONE
    top_mm = np.float64(_greatest(coarse.reshape(-1)))
    noise_mm = _height_noise(coarse, sample_step, sigma_per_median)
    noise_mm = min(noise_mm, largest_noise_share * top_mm)
    low_mm = max(min_indentation_mm, region_sigmas * noise_mm)
    detectable_mm = max(min_indentation_mm, detection_sigmas * noise_mm)
    if top_mm <= detectable_mm:
        return False
    slope = np.empty(coarse.shape, np.float32)
    scale = np.float32(0.5 / spacing_mm)
    raised = np.empty(coarse.shape, np.uint8)
    for i in range(height):
        # mirrored at the border of the map
        above, below = (i - 1, i + 1) if 0 < i < height - 1 else (i, i)
        _steep_row_to_its_ends(coarse[above], coarse[i], coarse[below], scale, slope[i])
        _above_row(coarse[i], np.float32(low_mm), raised[i])
    sample = slope[::sample_step, ::sample_step].copy().reshape(-1)
    steep = np.float32(max(min_slope, detection_sigmas * (quantile_of(sample, 0.25) / quartile)))
    runs, root = joined_runs(raised)
    count, levels = len(runs), bands[0]
    area, flank = np.zeros(count, np.int64), np.zeros(count, np.int64)
    peak_mm, band = np.zeros(count, np.float32), np.full(count, -1)
    for run in range(count):
        y, first, end = runs[run]
        of = root[run]
        area[of] += end - first
        peak_mm[of] = max(peak_mm[of], _greatest(coarse[y, first:end]))
        flank[of] += _count_above(slope[y, first:end], steep)
    found = 0
    for of in range(count):
        if area[of] >= min_area and peak_mm[of] > detectable_mm and flank[of] >= max(1, min_area):
            band[of] = found
            found += 1
    slopes, cells = np.zeros((found, levels)), np.zeros((found, levels))
    for run in range(count):
        k = band[root[run]]
        if k >= 0:
            y, first, end = runs[run]
            for j in range(first, end):
                depth = np.float32(levels) * (coarse[y, j] / peak_mm[root[run]])
                at = min(int(depth), levels - 1)
                slopes[k, at] += slope[y, j]
                cells[k, at] += 1
    limit = np.empty(found, np.float32)
    for of in range(count):
        if band[of] >= 0:
            share = border_fraction
            if share < 0:
                steepest = _steepest_band(slopes[band[of]], cells[band[of]], bands[1])
                share = bands[2] * (steepest + 0.5) / levels
            limit[band[of]] = max(low_mm, share * np.float64(peak_mm[of]))
    raised[:] = 0
    for run in range(count):
        k = band[root[run]]
        if k >= 0:
            y, first, end = runs[run]
            _above_row(coarse[y, first:end], limit[k], raised[y, first:end])
            for j in range(first, end):
                if raised[y, j]:
                    border_mm[y, j] = limit[k]
    return _without_specks(raised, min_area, border_mm)


@njit(**PART)
def _without_specks(touched: Any, min_area: float, border_mm: Any) -> bool:
    """Remove the border of small parts; return whether another part remains."""
    runs, root = joined_runs(touched)
    area, any_left = np.zeros(len(runs), np.int64), False
    for run in range(len(runs)):
        area[root[run]] += runs[run, 2] - runs[run, 1]
    for run in range(len(runs)):
        if area[root[run]] >= min_area:
            any_left = True
        else:
            border_mm[runs[run, 0], runs[run, 1] : runs[run, 2]] = _NONE
    return any_left


@njit(**ROW)
def _least(row: Any) -> Any:
    least = row[0]
    for j in range(row.size):
        least = min(least, row[j])
    return least


@njit(**EXACT_ROW)
def _above_rows(row: Any, limit: Any, out: Any) -> None:
    for j in range(row.size):
        out[j] = row[j] > limit[j]


@njit(**ROW)
def _extremes(above: Any, row: Any, below: Any, least: Any, most: Any) -> None:
    for j in range(row.size):
        least[j] = min(row[j], min(above[j], below[j]))
        most[j] = max(row[j], max(above[j], below[j]))


@njit(**ROW)
def _sides(least: Any, most: Any, limit: Any, out: Any) -> None:
    """Set 1 where a cell and its neighbours are above the limit, 0 where none is, else 2."""
    last = limit.size - 1
    out[0], out[last] = limit[0] < _NONE, limit[last] < _NONE
    out[0], out[last] = 2 * out[0], 2 * out[last]
    for j in range(1, last):
        low = min(least[j], min(least[j - 1], least[j + 1]))
        high = max(most[j], max(most[j - 1], most[j + 1]))
        one, none = low > limit[j], high <= limit[j]
        out[j] = np.uint8(1) if one else (np.uint8(0) if none else np.uint8(2))


@njit(**EXACT_ROW)
def _twice(sides: Any, out: Any) -> None:
    for j in range(sides.size):
        out[2 * j] = sides[j] & 1
        out[2 * j + 1] = sides[j] & 1


@njit(**PART)
def _repeated(sides: Any, times: int, out: Any) -> None:
    if times == 2:
        _twice(sides, out)
        return
    for j in range(sides.size):
        out[times * j : times * (j + 1)] = sides[j] & 1


@njit(**ROW)
def _lowest_row(above: Any, row: Any, below: Any, lowest: Any) -> Any:
    least = _NONE
    for j in range(row.size):
        low = min(row[j], min(above[j], below[j]))
        lowest[j] = low
        least = min(least, low)
    return least


@njit(**ROW)
def _lowest_beside(lowest: Any, near: Any) -> None:
    for j in range(near.size):
        near[j] = min(lowest[j + 1], min(lowest[j], lowest[j + 2]))


@njit(**PART)
def _lowest_near(border_mm: Any, i: int, spare: Any, near: Any) -> bool:
    """Lowest border of the 3 × 3 cells around each cell of a row; return whether there is one."""
    above, below = max(i - 1, 0), min(i + 1, len(border_mm) - 1)
    lowest = _lowest_row(border_mm[above], border_mm[i], border_mm[below], spare[1:-1])
    if lowest == _NONE:
        return False
    _lowest_beside(spare, near)
    return True


@njit(**PART)
def _columns(border_mm: Any) -> tuple[int, int]:
    """First column, and the one after the last, at or next to a border."""
    width = border_mm.shape[1]
    first, last = width, -1
    for i in range(len(border_mm)):
        row = border_mm[i]
        if _least(row) == _NONE:
            continue
        j = 0
        while row[j] == _NONE:
            j += 1
        first = min(first, j)
        j = width - 1
        while row[j] == _NONE:
            j -= 1
        last = max(last, j)
    return max(first - 1, 0), min(last + 2, width)


@njit(**LOOP)
def drawn_contact(cells: Any, border_mm: Any, step_px: int, mask: Any) -> None:
    """Set the pixels whose interpolated height is above the border of a cell at or next to them.

    Only cells that have a border in their neighbourhood are interpolated.

    Parameters
    ----------
    cells : (h, w) float32
        Height.
    border_mm : (h / n, w / n) float32
        From :func:`touched_regions`, with at least one border.
    step_px : int
        Side of a cell of the height.
    mask : (h · step_px, w · step_px) uint8
        0; overwritten by 1 in contact.
    """
    height, ratio = len(cells), len(cells) // len(border_mm)
    start, end = _columns(border_mm)
    border_mm, start, end = border_mm[:, start:end], start * ratio, end * ratio
    near, limit = np.empty(border_mm.shape[1], np.float32), np.empty(end - start, np.float32)
    spare = np.full(border_mm.shape[1] + 2, _NONE)
    least, most = np.empty(end - start, np.float32), np.empty(end - start, np.float32)
    sides = np.empty(end - start, np.uint8)
    for block in range(len(border_mm)):
        if not _lowest_near(border_mm, block, spare, near):
            continue
        for j in range(near.size):
            for k in range(ratio):
                limit[ratio * j + k] = near[j]
        for i in range(block * ratio, (block + 1) * ratio):
            row = cells[i, start:end]
            if step_px == 1:
                _above_rows(row, limit, mask[i, start:end])
                continue
            above, below = cells[max(i - 1, 0), start:end], cells[min(i + 1, height - 1), start:end]
            _extremes(above, row, below, least, most)
            _sides(least, most, limit, sides)
            for k in range(i * step_px, (i + 1) * step_px):
                _repeated(sides, step_px, mask[k, start * step_px : end * step_px])
            for j in range(sides.size):
                if sides[j] == 2:
                    _interpolated(cells, i, start + j, step_px, limit[j], mask)


@njit(**PART)
def _interpolated(cells: Any, i: int, j: int, step_px: int, limit: Any, mask: Any) -> None:
    """Set the pixels of one cell by bilinear interpolation."""
    height, width = cells.shape
    for a in range(step_px):
        down = (a + 0.5) / step_px - 0.5
        y = min(max(i + (1 if down > 0 else -1), 0), height - 1)
        v = np.float32(abs(down))
        for b in range(step_px):
            along = (b + 0.5) / step_px - 0.5
            x = min(max(j + (1 if along > 0 else -1), 0), width - 1)
            u = np.float32(abs(along))
            here = cells[i, j] * (1 - u) + cells[i, x] * u
            there = cells[y, j] * (1 - u) + cells[y, x] * u
            mask[i * step_px + a, j * step_px + b] = here * (1 - v) + there * v > limit
