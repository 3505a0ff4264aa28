"""Kernel of :mod:`tactile_core.sim.optics.markers`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.kernels.options import LOOP, ROW

ROUND, SQUARE, TRIANGLE = 0, 1, 2
"""Codes of the marker shapes: numba takes numbers rather than names."""
_SIN_60, _INSIDE = np.float32(np.sqrt(3) / 2), np.float32(1 / (2 * np.sqrt(3)))
"""Sine of 60°, and the radius of the circle inside a triangle of side 1."""


@njit(**ROW)
def _darken(
    dx: Any, dy: Any, cos: Any, sin: Any, size: Any, shape: int, lost: Any, row: Float32
) -> None:
    """Darken a part of a row by one marker; dx and dy are its first pixel's from the centre."""
    zero, half, one = np.float32(0), np.float32(0.5), np.float32(1)
    for j in range(row.size):
        across = dx + np.float32(j)
        x, y = across * cos + dy * sin, dy * cos - across * sin
        if shape == ROUND:
            outside = np.sqrt(x * x + y * y) - half * size
        elif shape == SQUARE:
            outside = max(abs(x), abs(y)) - half * size
        else:
            aside = abs(x) * _SIN_60 - half * y
            outside = max(y, aside) - size * _INSIDE
        share = min(max(half - outside, zero), one)
        row[j] = min(row[j], one - lost * share)


@njit(**LOOP)
def draw(centres: Any, turned: Any, size: float, shape: int, ink: float, bare: Float32) -> None:
    """Darken a bare gel surface by printed markers.

    Parameters
    ----------
    centres : (N, 2) float64
        x and y in px, finite.
    turned : (N,) float64
        Rotation, rad.
    size : float
        Diameter or side, px.
    shape : int
        0 round, 1 square, 2 triangle.
    ink : float
        Relative reflectance of the ink.
    bare : (H, W) float32
        Ones; overwritten where there are markers.
    """
    rows, columns = bare.shape
    lost = np.float32(1 - ink)
    for k in range(len(centres)):
        x0, y0 = centres[k]
        cos, sin = np.float32(np.cos(turned[k])), np.float32(np.sin(turned[k]))
        reach = size * 0.75 + 1
        if shape == ROUND:
            reach = size / 2 + 1
        elif shape == SQUARE:
            reach = size / 2 * float(abs(cos) + abs(sin)) + 1
        left, right = max(int(x0 - reach), 0), min(int(x0 + reach) + 2, columns)
        for i in range(max(int(y0 - reach), 0), min(int(y0 + reach) + 2, rows)):
            if left < right:
                dx, dy = np.float32(left - x0), np.float32(i - y0)
                _darken(dx, dy, cos, sin, np.float32(size), shape, lost, bare[i, left:right])
