"""Fourier transforms of a small part of a padded grid, as products with matrices."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.arrays.types import Array


class WaveProducts(NamedTuple):
    """Transforms of fields (m, n) in the first rows and columns of a grid (M, N), zero elsewhere.

    They cost more operations than the fast transform, but no padding, and only values in the part
    are transformed back: below some 80 nodes that is faster.

    Attributes
    ----------
    across : (n, 2 h) real
        From columns to h = N // 2 + 1 complex waves along x, real and imaginary parts by turns.
    down : (M, m) complex
        From rows to waves along y.
    up : (m, M) complex
        Back from waves along y to rows.
    back : (2 h, n) real
        Back from complex waves along x to columns.
    """

    across: Array
    down: NDArray[Any]
    up: NDArray[Any]
    back: Array

    @classmethod
    def of(cls, part: tuple[int, int], whole: tuple[int, int], dtype: DTypeLike) -> WaveProducts:
        """Prepare the transforms of a part (m, n) of a grid (M, N)."""
        (rows, columns), (all_rows, all_columns) = part, whole
        half = all_columns // 2 + 1
        along_x = _waves(half, columns, all_columns)
        down = _waves(all_rows, rows, all_rows)
        # waves between zero and Nyquist stand for their mirror images, too
        twice = np.full(half, 2.0)
        twice[0] = 1
        if all_columns % 2 == 0:
            twice[-1] = 1
        back = along_x * (twice / (all_rows * all_columns))[:, None]
        across = np.ascontiguousarray(along_x.T).view(np.float64)
        complex_type = np.result_type(dtype, np.complex64)
        return cls(
            across.astype(dtype),
            down.astype(complex_type),
            np.ascontiguousarray(down.conj().T).astype(complex_type),
            np.stack([back.real, back.imag], 1).reshape(2 * half, columns).astype(dtype),
        )

    def forward(self, field: Array) -> NDArray[Any]:
        """(..., M, h) complex waves of a field (..., m, n)."""
        return np.asarray(self.down @ (field @ self.across).view(self.down.dtype))

    def inverse(self, waves: NDArray[Any]) -> Array:
        """(..., m, n) field of waves (..., M, h), in the part only."""
        return np.asarray((self.up @ waves).view(self.back.dtype) @ self.back)


def _waves(waves: int, nodes: int, period: int) -> NDArray[np.complex128]:
    """(waves, nodes) values of exp(-i k x)."""
    turns = np.outer(np.arange(waves), np.arange(nodes)) / period
    return np.asarray(np.exp(-2j * np.pi * turns))
