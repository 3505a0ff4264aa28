"""Kernels of :mod:`tactile_core.sim.resampling`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, ROW
from tactile_core.sim.resampling import INVERSION

# compiled code reads plain numbers only
_WHOLE_STEPS, _TOLERANCE = INVERSION.whole_steps, INVERSION.tolerance_nodes
_STEPS = INVERSION.whole_steps + INVERSION.half_steps


@njit(**LOOP)
def _linear(across: Float32, down: Float32, x: Any, y: Any) -> tuple[Any, Any]:
    rows, columns = across.shape
    j = min(max(int(x), 0), columns - 2)
    i = min(max(int(y), 0), rows - 2)
    one = np.float32(1)
    a = min(max(x - np.float32(j), np.float32(0)), one)
    b = min(max(y - np.float32(i), np.float32(0)), one)
    nw, ne, sw, se = (one - a) * (one - b), a * (one - b), (one - a) * b, a * b
    return (
        nw * across[i, j]
        + ne * across[i, j + 1]
        + sw * across[i + 1, j]
        + se * across[i + 1, j + 1],
        nw * down[i, j] + ne * down[i, j + 1] + sw * down[i + 1, j] + se * down[i + 1, j + 1],
    )


@njit(**LOOP)
def _weights(t: Any, out: Float32) -> None:
    """Weights of the four uniform cubic B-splines that are non-zero at a fraction t of a cell."""
    one, sixth = np.float32(1), np.float32(1 / 6)
    s = one - t
    out[0] = s * s * s * sixth
    out[1] = (np.float32(4) + t * t * (np.float32(3) * t - np.float32(6))) * sixth
    out[2] = (np.float32(4) + s * s * (np.float32(3) * s - np.float32(6))) * sixth
    out[3] = t * t * t * sixth


@njit(**LOOP)
def at_present(moved: Float32, coefficients: Float32, first: tuple[int, int], out: Float32) -> None:
    """Displacement of the material that is now at each node of a window.

    Parameters
    ----------
    moved : (2, ny, nx) float32
        x and y displacement of each material node, in node spacings.
    coefficients : (3, ny + 2, nx + 2) float32
        Spline coefficients of x and y displacement and indentation.
    first : (int, int)
        Row and column of the window's first node.
    out : (3, my, mx) float32
        Overwritten, in the units of the coefficients.
    """
    across, down = moved
    rows, columns = across.shape
    wx, wy = np.empty(4, np.float32), np.empty(4, np.float32)
    zero, half = np.float32(0), np.float32(0.5)
    last_x, last_y = np.float32(columns - 1), np.float32(rows - 1)
    for i in range(out.shape[1]):
        row = i + first[0]
        dx, dy = across[row, first[1]], down[row, first[1]]
        for j in range(out.shape[2]):
            column = j + first[1]
            for step in range(_STEPS):
                # the displacement of the previous column is the first guess
                x, y = np.float32(column) - dx, np.float32(row) - dy
                new_x, new_y = _linear(across, down, x, y)
                change = max(abs(new_x - dx), abs(new_y - dy))
                if step < _WHOLE_STEPS:
                    dx, dy = new_x, new_y
                else:
                    dx, dy = (dx + new_x) * half, (dy + new_y) * half
                if change < np.float32(_TOLERANCE):
                    break
            x = min(max(np.float32(column) - dx, zero), last_x)
            y = min(max(np.float32(row) - dy, zero), last_y)
            left, top = min(int(x), columns - 2), min(int(y), rows - 2)
            _weights(x - np.float32(left), wx)
            _weights(y - np.float32(top), wy)
            for part in range(3):
                total = zero
                for a in range(4):
                    line = coefficients[part, top + a]
                    total += wy[a] * (
                        wx[0] * line[left]
                        + wx[1] * line[left + 1]
                        + wx[2] * line[left + 2]
                        + wx[3] * line[left + 3]
                    )
                out[part, i, j] = total


@njit(**EXACT_ROW)
def _along(row: Float32, first: Any, weights: Float32, out: Float32) -> None:
    for j in range(out.size):
        k = first[j]
        out[j] = (
            weights[0, j] * row[k]
            + weights[1, j] * row[k + 1]
            + weights[2, j] * row[k + 2]
            + weights[3, j] * row[k + 3]
        )


@njit(**ROW)
def _combined(
    a: Float32, b: Float32, c: Float32, d: Float32, weights: Float32, out: Float32
) -> None:
    wa, wb, wc, wd = weights[0], weights[1], weights[2], weights[3]
    for j in range(out.size):
        out[j] = wa * a[j] + wb * b[j] + wc * c[j] + wd * d[j]


@njit(**LOOP)
def values(
    coefficients: Float32,
    rows: tuple[Any, Float32],
    columns: tuple[Any, Float32],
    out: Float32,
) -> None:
    """Evaluate a spline on another grid.

    Parameters
    ----------
    coefficients : (ny + 2, nx + 2) float32
        Coefficients of uniform cubic B-splines.
    rows, columns : (first, weights)
        For each position along an axis: the (N,) index of the first of four coefficients, and
        their (4, N) weights.
    out : (H, W) float32
        Overwritten.
    """
    along = np.empty((len(coefficients), out.shape[1]), np.float32)
    first, weights = rows
    for i in range(first[0], first[-1] + 4):
        _along(coefficients[i], columns[0], columns[1], along[i])
    four = np.empty(4, np.float32)
    for i in range(len(out)):
        k = first[i]
        for a in range(4):
            four[a] = weights[a, i]
        _combined(along[k], along[k + 1], along[k + 2], along[k + 3], four, out[i])
