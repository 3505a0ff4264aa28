"""Inverse of the Laplacian with compiled loops: transform the rows, solve along the columns."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.kernels import load
from tactile_core.algorithms.poisson.cosines import CosineRows
from tactile_core.algorithms.scratch import borrowed

Array = NDArray[Any]

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

        def order(first: int, out: Array) -> None:
            _kernels().in_dft_order(rhs[first : first + len(out)], out)

        self._solve(order, 1.0, rhs)
        return rhs

    def integrated(self, gx: Array, gy: Array, mm_per_px: float) -> Array:
        """Return the (H, W) float32 height of these slopes, of at least 2 × 2 pixels."""

        def order(first: int, out: Array) -> None:
            _kernels().divergence_in_dft_order(gx, gy, first, out)

        height = np.empty(gx.shape, np.float32)
        self._solve(order, 0.5 * mm_per_px, height)
        return height

    def _solve(self, order: Callable[[int, Array], None], gain: float, out: Array) -> None:
        """Write ``gain`` times the solution.

        It goes down and up again in bands of rows that stay in the cache from step to step;
        ``order`` writes those of the right-hand side, in the DFT's order, from a row on.
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
                some = memory[: last - first]
                order(first, some)
                cv2.dft(some, dst=out[first:last], flags=cv2.DFT_ROWS)
                kernels.forward_columns(out, first, last, self._turn, self._pivots, low)
            kernels.solve_low(low, self._low_pivots)
            for first, last in reversed(bands):
                some = memory[: last - first]
                kernels.backward_columns(out, first, last, self._turn, self._pivots, low)
                flags = cv2.DFT_ROWS | cv2.DFT_INVERSE | cv2.DFT_SCALE
                cv2.dft(out[first:last], dst=some, flags=flags)
                kernels.from_dft_order(some, gain, out[first:last])


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
