"""Inverse of the Laplacian with compiled loops: transform the rows, solve along the columns."""

from __future__ import annotations

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
        self._cosine, self._sine = rows.turn.real.copy(), rows.turn.imag.copy()

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        kernels = load()
        assert kernels is not None
        with borrowed(rhs.shape, np.float32) as ordered:
            kernels.in_dft_order(rhs, ordered)
            cv2.dft(ordered, dst=rhs, flags=cv2.DFT_ROWS)
            kernels.solve_columns(rhs, self._cosine, self._sine, self._pivots, self._low_pivots)
            cv2.dft(rhs, dst=ordered, flags=cv2.DFT_ROWS | cv2.DFT_INVERSE | cv2.DFT_SCALE)
            kernels.from_dft_order(ordered, rhs)
        return rhs


def _inverse_pivots(eigenvalues: Array, height: int) -> Array:
    """(H, W) of the elimination from the first row on; the first and last row have one face."""
    diagonal = np.full(height, 2.0)
    diagonal[[0, -1]] = 1 if height > 1 else 0
    inverse = np.empty((height, len(eigenvalues)))
    above = np.zeros_like(eigenvalues)
    for i in range(height):
        above = inverse[i] = 1 / (diagonal[i] + eigenvalues - above)
    return inverse
