"""Kernel of :mod:`tactile_core.sim.optics.markers`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.kernels.options import LOOP

ROUND, SQUARE, TRIANGLE = 0, 1, 2
"""Codes of the marker shapes: numba takes numbers rather than names."""


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
    reach = size * (0.5 if shape == ROUND else 0.75) + 1
    whole = max(size / 2 - 0.5, 0.0) ** 2  # closer to the middle, a round marker covers the pixel
    for k in range(len(centres)):
        x0, y0 = centres[k]
        cos, sin = np.cos(turned[k]), np.sin(turned[k])
        for i in range(max(int(y0 - reach), 0), min(int(y0 + reach) + 2, rows)):
            for j in range(max(int(x0 - reach), 0), min(int(x0 + reach) + 2, columns)):
                dx, dy = j - x0, i - y0
                square = dx * dx + dy * dy
                if square > reach * reach:
                    continue
                x, y = dx * cos + dy * sin, dy * cos - dx * sin
                if shape == ROUND:
                    outside = -1.0 if square < whole else np.sqrt(square) - size / 2
                elif shape == SQUARE:
                    outside = max(abs(x), abs(y)) - size / 2
                else:
                    aside = abs(x) * np.sqrt(3) / 2 - y / 2
                    outside = max(y, aside) - size / (2 * np.sqrt(3))
                share = min(max(0.5 - outside, 0.0), 1.0)
                bare[i, j] = min(bare[i, j], np.float32(1 - (1 - ink) * share))
