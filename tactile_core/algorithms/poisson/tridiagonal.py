"""Inverse of the Laplacian with compiled loops: transform the rows, solve along the columns."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import ModuleType

import cv2
import numpy as np

from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.kernels import load
from tactile_core.algorithms.poisson.cosines import CosineRows, from_dft_order, in_dft_order

_LOW_SHARE = 20
"""Of the packed coefficients the first 1/20, half of them of low frequency, in double precision."""

_BAND_PX = 120_000

_FREE = 1e-9
"""In place of the eigenvalue 0; what it lets through is a constant, which is taken off."""


class TridiagonalLaplacian:
    """Neumann, in float32.

    After a cosine transform of the rows each coefficient has tridiagonal equations down its column,
    which cost two passes where a transform and its inverse cost many.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        height, width = shape
        rows = CosineRows(width, np.float32)
        eigenvalues = 2 - 2 * np.cos(np.pi * rows.frequencies / width)
        eigenvalues[0] = _FREE
        exact = _inverse_pivots(eigenvalues, height)
        low = min(width, 8 + width // _LOW_SHARE)
        self._low_pivots = np.ascontiguousarray(exact[:, :low])
        pivots = exact.astype(np.float32)
        pivots[:, :low] = 0
        changing = np.flatnonzero((pivots[1:-1] != pivots[:-2]).any(axis=1))
        settled = int(changing[-1]) + 2 if changing.size else 1
        self._pivots = np.concatenate([pivots[:-1][:settled], pivots[-1:]])
        self._turn = np.stack([rows.turn.real, rows.turn.imag])

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        self._solve(rhs, 1.0, lambda first, rows: None)
        return rhs

    def integrated(self, gx: Array, gy: Array, mm_per_px: float) -> Array:
        """Return the (H, W) float32 height of these slopes, of at least 2 × 2 pixels."""
        height = np.empty(gx.shape, np.float32)
        divergence = partial(_kernels().double_divergence, gx, gy)
        self._solve(height, 0.5 * mm_per_px, divergence)
        return height

    def _solve(self, out: Array, gain: float, write: Callable[[int, Array], None]) -> None:
        """Replace the right-hand side by ``gain`` times its solution.

        It goes down and up again in bands of rows that stay in the cache from step to step;
        ``write`` writes those of the right-hand side, from a row on, if they are not there yet.
        """
        kernels = _kernels()
        rows, columns = out.shape
        step = max(1, _BAND_PX // columns)
        bands = [(first, min(first + step, rows)) for first in range(0, rows, step)]
        with (
            borrowed((step, columns), np.float32) as memory,
            borrowed(self._low_pivots.shape, np.float64) as low,
        ):
            for first, last in bands:
                band, some = out[first:last], memory[: last - first]
                write(first, band)
                in_dft_order(band.T, some.T)
                cv2.dft(some, dst=band, flags=cv2.DFT_ROWS)
                kernels.forward_columns(out, first, last, self._turn, self._pivots, low)
            kernels.solve_low(low, self._low_pivots)
            for first, last in reversed(bands):
                band, some = out[first:last], memory[: last - first]
                kernels.backward_columns(out, first, last, self._turn, self._pivots, low)
                cv2.dft(band, dst=some, flags=cv2.DFT_ROWS | cv2.DFT_INVERSE | cv2.DFT_SCALE)
                np.multiply(some, np.float32(gain), out=some)
                from_dft_order(some.T, band.T)


def _kernels() -> ModuleType:
    kernels = load()
    assert kernels is not None
    return kernels


def _inverse_pivots(eigenvalues: Array, height: int) -> Array:
    """(H, W) of the elimination from the first row on; the first and last row have one face."""
    diagonal = np.full(height, 2.0)
    diagonal[[0, -1]] = 1 if height > 1 else 0
    inverse = np.empty((height, len(eigenvalues)))
    above = np.zeros_like(eigenvalues)
    for i in range(height):
        above = inverse[i] = 1 / (diagonal[i] + eigenvalues - above)
    return inverse
