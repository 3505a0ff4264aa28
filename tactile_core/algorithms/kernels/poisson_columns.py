"""Kernels of :mod:`tactile_core.algorithms.poisson`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.kernels.options import LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import copy_row


@njit(**ROW)
def _difference(first: Float32, second: Float32, out: Float32) -> None:
    for j in range(out.size):
        out[j] = second[j] - first[j]


@njit(**ROW)
def _add_difference(first: Float32, second: Float32, out: Float32) -> None:
    for j in range(out.size):
        out[j] += second[j] - first[j]


@njit(**ROW)
def _sum(first: Float32, second: Float32, sign: Any, out: Float32) -> None:
    for j in range(out.size):
        out[j] = sign * (first[j] + second[j])


@njit(**LOOP)
def double_divergence(gx: Float32, gy: Float32, first: int, out: Float32) -> None:
    """Twice the divergence with a free border, for a band of rows.

    Parameters
    ----------
    gx, gy : (H, W) float32
        Slopes of at least 2 × 2 pixels.
    first : int
        First row of the band.
    out : (B, W) float32
        Overwritten by the band.
    """
    rows, columns = gx.shape
    for k in range(len(out)):
        i, row = first + k, out[k]
        if i == 0:
            _sum(gy[0], gy[1], np.float32(1), row)
        elif i == rows - 1:
            _sum(gy[i - 1], gy[i], np.float32(-1), row)
        else:
            _difference(gy[i - 1], gy[i + 1], row)
        slope = gx[i]
        row[0] += slope[0] + slope[1]
        row[columns - 1] -= slope[columns - 2] + slope[columns - 1]
        _add_difference(slope[:-2], slope[2:], row[1:-1])


@njit(**ROW)
def _turned(pairs: Float32, cosine: Float32, sine: Float32) -> None:
    for k in range(cosine.size):
        real, imaginary = pairs[2 * k], pairs[2 * k + 1]
        pairs[2 * k] = real * cosine[k] - imaginary * sine[k]
        pairs[2 * k + 1] = real * sine[k] + imaginary * cosine[k]


@njit(**ROW)
def _turned_back(pairs: Float32, cosine: Float32, sine: Float32) -> None:
    for k in range(cosine.size):
        real, imaginary = pairs[2 * k], pairs[2 * k + 1]
        pairs[2 * k] = real * cosine[k] + imaginary * sine[k]
        pairs[2 * k + 1] = imaginary * cosine[k] - real * sine[k]


@njit(**ROW)
def _forward(above: Any, pivot: Any, row: Any) -> None:
    for k in range(row.size):
        row[k] = (above[k] - row[k]) * pivot[k]


@njit(**ROW)
def _backward(below: Any, pivot: Any, row: Any) -> None:
    for k in range(row.size):
        row[k] += pivot[k] * below[k]


@njit(**PART)
def _centre(low: Any) -> None:
    mean = 0.0
    for i in range(len(low)):
        mean += low[i, 0] / len(low)
    for i in range(len(low)):
        low[i, 0] -= mean


@njit(**LOOP)
def solve_low(low: Any, pivots: Any) -> None:
    """Solve the low frequencies in double precision, in place; the free constant becomes 0.

    Parameters
    ----------
    low : (H, L) float64
        Coefficients from :func:`forward_columns`.
    pivots : (H, L) float64
        Inverse pivots of the elimination.
    """
    rows = len(low)
    _centre(low)
    _forward(np.zeros(low.shape[1]), pivots[0], low[0])
    for i in range(1, rows):
        _forward(low[i - 1], pivots[i], low[i])
    for i in range(rows - 2, -1, -1):
        _backward(low[i + 1], pivots[i], low[i])
    _centre(low)


@njit(**LOOP)
def forward_columns(
    packed: Float32, first: int, last: int, turn: Float32, pivots: Float32, low: Any
) -> None:
    """Eliminate downwards in the tridiagonal equations of every cosine coefficient, in place.

    Parameters
    ----------
    packed : (H, W) float32
        Real DFT of each row, as OpenCV packs it.
    first, last : int
        Band of rows; the rows above have been eliminated before.
    turn : (2, P) float32
        Cosines and sines of the rotations from pairs of the DFT to coefficients.
    pivots : (R, W) float32
        Inverse pivots: of the first rows, then the common one of the others, then of the last row.
    low : (H, L) float64
        Receives the first coefficients of each row, which need double precision.
    """
    end = 1 + 2 * turn.shape[1]
    settled = len(pivots) - 2
    above = packed[first - 1] if first else np.zeros(packed.shape[1], np.float32)
    for i in range(first, last):
        row = packed[i]
        _turned(row[1:end], turn[0], turn[1])
        copy_row(row[: low.shape[1]], low[i])
        _forward(above, pivots[-1] if i == len(packed) - 1 else pivots[min(i, settled)], row)
        above = row


@njit(**LOOP)
def backward_columns(
    packed: Float32, first: int, last: int, turn: Float32, pivots: Float32, low: Any
) -> None:
    """Substitute upwards after :func:`forward_columns`, and restore the DFT of the solution.

    The rows below have been substituted before. ``low`` holds the solution of :func:`solve_low`.
    """
    end = 1 + 2 * turn.shape[1]
    settled = len(pivots) - 2
    for i in range(last - 1, first - 1, -1):
        if i:
            _backward(packed[i], pivots[min(i - 1, settled)], packed[i - 1])
        copy_row(low[i], packed[i])
        _turned_back(packed[i, 1:end], turn[0], turn[1])
