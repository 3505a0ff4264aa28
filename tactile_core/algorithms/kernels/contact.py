"""Kernels of :mod:`tactile_core.algorithms.contact`: the regions in contact, and their pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import set_row
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
def _raise_to(row: Any, most: Any) -> None:
    for j in range(row.size):
        most[j] = max(most[j], row[j])


@njit(**PART)
def _peak(coarse: Any) -> Any:
    """Greatest height; column by column, because a maximum of a single line is not vectorised."""
    most = coarse[0].copy()
    for i in range(1, len(coarse)):
        _raise_to(coarse[i], most)
    greatest = most[0]
    for value in most:
        greatest = max(greatest, value)
    return greatest


@njit(**EXACT_ROW)
def _greatest_bits(bits: Any) -> Any:
    """Greatest of (N,) int32 numbers: the bits of float32 heights above 0, ordered as they are."""
    most = np.int32(0)
    for j in range(bits.size):
        most = max(most, bits[j])
    return most


@njit(**PART)
def _height_noise(coarse: Any, step: int, sigma_per_median: float) -> float:
    """Noise of the height, from a sample of the cells below 0."""
    depth, found = np.empty(coarse.size + 1, np.float32), 0
    for i in range(0, coarse.shape[0], step):
        for j in range(0, coarse.shape[1], step):
            depth[found] = -coarse[i, j]
            found += coarse[i, j] < 0
    return sigma_per_median * quantile_of(depth[:found], 0.5) if found else 0.0


@njit(**EXACT_ROW)
def _bands_of(row: Any, peak: Any, levels: int, band: Any) -> None:
    for j in range(row.size):
        band[j] = min(np.int32(np.float32(levels) * (row[j] / peak)), np.int32(levels - 1))


@njit(**PART)
def _add_slopes(slope: Any, band: Any, highest: int, total: Any) -> None:
    """Add the slopes of a row to the sums (2, 2, bands) of slopes and cells in the lower bands.

    Neighbours, most often of the same band, are added to different sums, so that none waits.
    """
    for j in range(band.size):
        if band[j] <= highest:
            total[j & 1, 0, band[j]] += slope[j]
            total[j & 1, 1, band[j]] += 1


@njit(**EXACT_ROW)
def _border_row(row: Any, limit: Any, touched: Any, border: Any) -> None:
    for j in range(row.size):
        above = row[j] > limit
        touched[j], border[j] = above, limit if above else _NONE


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
    top, bottom, left, right : int
        First row and column at or next to a cell that touches, and those after the last; 0 if none
        does.
    """
    height = len(coarse)
    min_indentation_mm, border_fraction, min_slope, min_area = options
    sigma_per_median, region_sigmas, detection_sigmas, largest_noise_share, quartile = noise
    for i in range(height):
        set_row(border_mm[i], _NONE)
    top_mm = np.float64(_peak(coarse))
    noise_mm = _height_noise(coarse, sample_step, sigma_per_median)
    noise_mm = min(noise_mm, largest_noise_share * top_mm)
    low_mm = max(min_indentation_mm, region_sigmas * noise_mm)
    detectable_mm = max(min_indentation_mm, detection_sigmas * noise_mm)
    if top_mm <= detectable_mm:
        return 0, 0, 0, 0
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
    peak_bits, coarse_bits = peak_mm.view(np.int32), coarse.view(np.int32)
    for run in range(count):
        y, first, end = runs[run]
        of = root[run]
        area[of] += end - first
        peak_bits[of] = max(peak_bits[of], _greatest_bits(coarse_bits[y, first:end]))
        flank[of] += _count_above(slope[y, first:end], steep)
    found = 0
    for of in range(count):
        if area[of] >= min_area and peak_mm[of] > detectable_mm and flank[of] >= max(1, min_area):
            band[of] = found
            found += 1
    total, at = np.zeros((found, 2, 2, levels)), np.empty(coarse.shape[1], np.int32)
    for run in range(count):
        k = band[root[run]]
        if k >= 0 and border_fraction < 0:
            y, first, end = runs[run]
            _bands_of(coarse[y, first:end], peak_mm[root[run]], levels, at[first:end])
            _add_slopes(slope[y, first:end], at[first:end], bands[1] + 1, total[k])
    limit = np.empty(found, np.float32)
    for of in range(count):
        if band[of] >= 0:
            share = border_fraction
            if share < 0:
                sums = total[band[of], 0] + total[band[of], 1]
                steepest = _steepest_band(sums[0], sums[1], bands[1])
                share = bands[2] * (steepest + 0.5) / levels
            limit[band[of]] = max(low_mm, share * np.float64(peak_mm[of]))
    for i in range(height):
        set_row(raised[i], np.uint8(0))
    for run in range(count):
        k = band[root[run]]
        if k >= 0:
            y, first, end = runs[run]
            row = coarse[y, first:end]
            _border_row(row, limit[k], raised[y, first:end], border_mm[y, first:end])
    return _without_specks(raised, min_area, border_mm)


@njit(**PART)
def _without_specks(touched: Any, min_area: float, border_mm: Any) -> tuple[int, int, int, int]:
    """Remove the border of small parts; return the box of the others as :func:`touched_regions`."""
    runs, root = joined_runs(touched)
    area = np.zeros(len(runs), np.int64)
    (rows, columns), bottom, right = touched.shape, 0, 0
    top, left = rows, columns
    for run in range(len(runs)):
        area[root[run]] += runs[run, 2] - runs[run, 1]
    for run in range(len(runs)):
        y, first, end = runs[run]
        if area[root[run]] >= min_area:
            top, bottom = min(top, y), max(bottom, y + 1)
            left, right = min(left, first), max(right, end)
        else:
            border_mm[y, first:end] = _NONE
    if not bottom:
        return 0, 0, 0, 0
    return max(top - 1, 0), min(bottom + 1, rows), max(left - 1, 0), min(right + 1, columns)


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
def _lowest_row(above: Any, row: Any, below: Any, lowest: Any) -> None:
    for j in range(row.size):
        lowest[j] = min(row[j], min(above[j], below[j]))


@njit(**ROW)
def _lowest_beside(lowest: Any, near: Any) -> None:
    for j in range(near.size):
        near[j] = min(lowest[j + 1], min(lowest[j], lowest[j + 2]))


@njit(**PART)
def _lowest_near(border_mm: Any, i: int, start: int, spare: Any, near: Any) -> None:
    """Write the lowest border of the 3 × 3 cells around each cell of a part of a row."""
    above, below = max(i - 1, 0), min(i + 1, len(border_mm) - 1)
    end = start + near.size
    row = border_mm[i, start:end]
    _lowest_row(border_mm[above, start:end], row, border_mm[below, start:end], spare[1:-1])
    _lowest_beside(spare, near)


@njit(**LOOP)
def drawn_contact(
    cells: Any, border_mm: Any, box: tuple[int, int, int, int], step_px: int, mask: Any
) -> None:
    """Set the pixels whose interpolated height is above the border of a cell at or next to them.

    Only cells that have a border in their neighbourhood are interpolated.

    Parameters
    ----------
    cells : (h, w) float32
        Height.
    border_mm : (h / n, w / n) float32
    box : (int, int, int, int)
        From :func:`touched_regions`; not empty.
    step_px : int
        Side of a cell of the height.
    mask : (h · step_px, w · step_px) uint8
        0; overwritten by 1 in contact.
    """
    height, ratio = len(cells), len(cells) // len(border_mm)
    top, bottom, start, end = box
    left, across = start, end - start
    start, end = start * ratio, end * ratio
    near, limit = np.empty(across, np.float32), np.empty(end - start, np.float32)
    spare = np.full(across + 2, _NONE)
    least, most = np.empty(end - start, np.float32), np.empty(end - start, np.float32)
    sides = np.empty(end - start, np.uint8)
    for block in range(top, bottom):
        _lowest_near(border_mm, block, left, spare, near)
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
