"""Kernel of :mod:`tactile_core.algorithms.slope_field`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactile_core.algorithms.kernels.options import LOOP, ROW

Float32 = NDArray[np.float32]


@njit(**ROW)
def _slopes_of_row(
    above_x: Float32,
    below_x: Float32,
    above_y: Float32,
    below_y: Float32,
    share: Any,
    steepest: Any,
    gx: Float32,
    gy: Float32,
) -> None:
    one = np.float32(1)
    limit = steepest * steepest
    for j in range(gx.size):
        x = above_x[j] + share * (below_x[j] - above_x[j])
        y = above_y[j] + share * (below_y[j] - above_y[j])
        square = x * x + y * y
        gain = one / np.sqrt(one - min(square, limit))
        gain *= min(one, steepest / np.sqrt(max(square, np.float32(1e-12))))
        gx[j] = x * gain
        gy[j] = y * gain


@njit(**LOOP)
def to_slopes(
    nx: Float32, ny: Float32, step: int, steepest: float, gx: Float32, gy: Float32
) -> None:
    """Turn sines, which are known on every ``step``-th row, into slopes; linear between them.

    Parameters
    ----------
    nx, ny : (R, W) float32
        Sines; each row is the middle of ``step`` rows of the image.
    step : int
    steepest : float
        The largest sine; steeper ones keep their direction.
    gx, gy : (H, W) float32
        Overwritten by slopes.
    """
    for i in range(len(gx)):
        place = min(max((i + 0.5) / step - 0.5, 0.0), len(nx) - 1.0)
        above = int(place)
        below = min(above + 1, len(nx) - 1)
        _slopes_of_row(
            nx[above],
            nx[below],
            ny[above],
            ny[below],
            np.float32(place - above),
            np.float32(steepest),
            gx[i],
            gy[i],
        )
