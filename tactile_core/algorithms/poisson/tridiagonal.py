"""Inverse Laplacian with compiled loops: transform the rows, solve along the columns."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.kernels import load
from tactile_core.algorithms.poisson.cosines import CosineRows, from_dft_order, in_dft_order


class TridiagonalParameters(NamedTuple):
    """Parameters of precision and speed. Nothing sets them: heights differ by rounding.

    Attributes
    ----------
    low_divisor : int, ratio
        This fraction (1 / 20) of the packed coefficients is solved in double precision; half of
        them have a low frequency.
        Source: chosen by hand; no script derives it.
    least_low : int, count
        Added to that number.
        Source: chosen by hand; no script derives it.
    band_px : int, px²
        Pixels that are processed together and stay in the cache.
        Source: chosen by hand; smaller bands of 30 rows of 640 px are no faster (ADR 30).
    free_eigenvalue : float, ratio
        Replaces the eigenvalue 0 of the constant, which is removed from the solution.
        Source: chosen by hand; no script derives it.
    """

    low_divisor: int = 20
    least_low: int = 8
    band_px: int = 120_000
    free_eigenvalue: float = 1e-9


TRIDIAGONAL = TridiagonalParameters()
"""The values in use."""


class TridiagonalLaplacian:
    """Laplacian with a Neumann border, in float32.

    After a cosine transform of the rows [1]_, each coefficient has tridiagonal equations along its
    column. They take two passes, where a transform along the columns and its inverse take many.

    References
    ----------
    .. [1] R. W. Hockney, "A fast direct solution of Poisson's equation using Fourier analysis",
       Journal of the ACM 12(1), 1965.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        height, width = shape
        rows = CosineRows(width, np.float32)
        eigenvalues = 2 - 2 * np.cos(np.pi * rows.frequencies / width)
        eigenvalues[0] = TRIDIAGONAL.free_eigenvalue
        exact = _inverse_pivots(eigenvalues, height)
        low = min(width, TRIDIAGONAL.least_low + width // TRIDIAGONAL.low_divisor)
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

        Elimination runs downwards and substitution upwards in bands of rows that stay in the cache
        from step to step. ``write(first, band)`` computes a band of the right-hand side, if it is
        not there yet.
        """
        kernels = _kernels()
        rows, columns = out.shape
        step = max(1, TRIDIAGONAL.band_px // columns)
        bands = [(first, min(first + step, rows)) for first in range(0, rows, step)]
        with (
            borrowed((step, columns), np.float32) as memory,
            borrowed(self._low_pivots.shape, np.float64) as low,
        ):
            for first, last in bands:
                band, spare = out[first:last], memory[: last - first]
                write(first, band)
                in_dft_order(band.T, spare.T)
                cv2.dft(spare, dst=band, flags=cv2.DFT_ROWS)
                kernels.forward_columns(out, first, last, self._turn, self._pivots, low)
            kernels.solve_low(low, self._low_pivots)
            for first, last in reversed(bands):
                band, spare = out[first:last], memory[: last - first]
                kernels.backward_columns(out, first, last, self._turn, self._pivots, low)
                cv2.dft(band, dst=spare, flags=cv2.DFT_ROWS | cv2.DFT_INVERSE | cv2.DFT_SCALE)
                np.multiply(spare, np.float32(gain), out=spare)
                from_dft_order(spare.T, band.T)


def _kernels() -> ModuleType:
    kernels = load()
    assert kernels is not None
    return kernels


def _inverse_pivots(eigenvalues: Array, height: int) -> Array:
    """Inverse pivots of the elimination, (H, W); the first and last row have one face less."""
    diagonal = np.full(height, 2.0)
    diagonal[[0, -1]] = 1 if height > 1 else 0
    inverse = np.empty((height, len(eigenvalues)))
    above = np.zeros_like(eigenvalues)
    for i in range(height):
        above = inverse[i] = 1 / (diagonal[i] + eigenvalues - above)
    return inverse
