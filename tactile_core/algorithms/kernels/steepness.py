"""Kernels of the grid of slip: its displacements, and its slopes for the contact area."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART, ROW
from tactile_core.algorithms.kernels.selection import quantile_of


@njit(**PART)
def _place(pixel: int, step_px: int, count: int) -> tuple[int, int, Any]:
    """Cells before and after a pixel, and the weight of the second."""
    at = (pixel + 0.5) / step_px - 0.5
    first = int(np.floor(at))
    weight = np.float32(at - first)
    return max(first, 0), min(first + 1, count - 1), weight


@njit(**ROW)
def _mixed(row: Any, other: Any, weight: Any, out: Any) -> None:
    for j in range(out.size):
        out[j] = row[j] + (other[j] - row[j]) * weight


@njit(**PART)
def _sample(cells: Any, step_px: int, stride: int, heights: Any) -> None:
    """Interpolate the cells in the middle of each block of pixels."""
    rows, columns = cells.shape
    height, width = heights.shape
    lefts, rights = np.empty((2, width), np.int64)
    weights = np.empty(width, np.float32)
    for j in range(width):
        lefts[j], rights[j], weights[j] = _place(stride // 2 + j * stride, step_px, columns)
    line = np.empty(columns, np.float32)
    for i in range(height):
        top, bottom, weight = _place(stride // 2 + i * stride, step_px, rows)
        _mixed(cells[top], cells[bottom], weight, line)
        for j in range(width):
            left = line[lefts[j]]
            heights[i, j] = left + (line[rights[j]] - left) * weights[j]


@njit(**PART)
def _around(at: Any, count: int) -> tuple[int, int, Any]:
    """Cells before and after a place, and the weight of the second; beyond the border, those."""
    first = int(np.floor(at))
    weight = np.float32(at - np.float32(first))
    return min(max(first, 0), count - 1), min(max(first + 1, 0), count - 1), weight


@njit(**LOOP)
def coarse_field(cells: Any, x: Any, y: Any) -> Any:
    """Interpolate displacements between the centres of cells.

    Parameters
    ----------
    cells : (rows, columns, 2) float32
    x : (w,) float32
    y : (h,) float32
        Places, in cells from the centre of the first one.

    Returns
    -------
    (h, w) complex64
        x + iy.
    """
    rows, columns = cells.shape[:2]
    field = np.empty((y.size, x.size), np.complex64)
    lefts, rights = np.empty((2, x.size), np.int64)
    weights, line = np.empty(x.size, np.float32), np.empty(2 * columns, np.float32)
    for j in range(x.size):
        lefts[j], rights[j], weights[j] = _around(x[j], columns)
    for i in range(y.size):
        top, bottom, weight = _around(y[i], rows)
        _mixed(cells[top].reshape(-1), cells[bottom].reshape(-1), weight, line)
        out = field[i].view(np.float32)
        for j in range(x.size):
            left, right = 2 * lefts[j], 2 * rights[j]
            out[2 * j] = line[left] + (line[right] - line[left]) * weights[j]
            left, right = left + 1, right + 1
            out[2 * j + 1] = line[left] + (line[right] - line[left]) * weights[j]
    return field


@njit(**ROW)
def _smoothed(above: Any, row: Any, below: Any, across: Any, down: Any) -> None:
    for j in range(row.size):
        across[j] = above[j] + 2 * row[j] + below[j]
        down[j] = below[j] - above[j]


@njit(**ROW)
def _steep(across: Any, down: Any, scale: Any, out: Any) -> None:
    for j in range(out.size):
        x = (across[j + 2] - across[j]) * scale
        y = (down[j] + 2 * down[j + 1] + down[j + 2]) * scale
        out[j] = np.sqrt(x * x + y * y)


@njit(**LOOP)
def steepness_of(
    cells: Any, step_px: int, stride: int, spacing_mm: float, share: float, steep: Any
) -> Any:
    """Slope of a height map in the middle of each block of pixels, smoothed by Sobel's operator.

    Parameters
    ----------
    cells : (rows, columns) float32
        Height, from the first row and column of the image on.
    step_px, stride : int
        Sides of a cell and of a block.
    spacing_mm : float
        Side of a block.
    share : float
        Which quantile of the slopes is returned.
    steep : (h, w) float32
        Overwritten by the slopes; at least 2 × 2 blocks.

    Returns
    -------
    float
    """
    height, width = steep.shape
    heights = np.empty(steep.shape, np.float32)
    _sample(cells, step_px, stride, heights)
    scale = np.float32(0.125 / spacing_mm)
    across, down = np.empty(width + 2, np.float32), np.empty(width + 2, np.float32)
    for i in range(height):
        # mirrored at the border of the view
        above, below = (i - 1, i + 1) if 0 < i < height - 1 else (1, 1)
        if i == height - 1:
            above = below = height - 2
        _smoothed(heights[above], heights[i], heights[below], across[1:-1], down[1:-1])
        across[0], across[-1], down[0], down[-1] = across[2], across[-3], down[2], down[-3]
        _steep(across, down, scale, steep[i])
    return quantile_of(steep.reshape(-1), share)
