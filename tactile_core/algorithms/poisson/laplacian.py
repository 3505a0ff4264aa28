"""Inverse of the five-point Laplacian on a rectangle, by fast transforms.

Neumann: no face at the border counts; the cosine transform (DCT-II) diagonalises it. Dirichlet:
0 at the pixels one step outside the border; the sine transform (DST-I) diagonalises it.

The cosine transform is made of OpenCV's real DFT where OpenCV has a fast one: as fast as
``scipy.fft``, and without its import, which takes half as long as a whole run on one image. Else,
and for the sine transform, ``scipy.fft`` does it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, Protocol

import cv2
import numpy as np
from numpy.typing import DTypeLike, NDArray

Array = NDArray[Any]
Boundary = Literal["neumann", "dirichlet"]

_LARGE_PX = 1_000_000
"""Beyond it the many passes of :class:`DftLaplacian` fall out of the cache."""


class Laplacian(Protocol):
    """A Laplacian that can be inverted; immutable."""

    def solve(self, rhs: Array) -> Array:
        """Return the (H, W) z of L z = rhs, L z = Σ (neighbour − z), in the memory of rhs.

        "neumann" takes the mean off rhs, and gives a z of mean 0.
        """
        ...


@lru_cache(maxsize=4)
def laplacian(
    shape: tuple[int, int], boundary: Boundary, dtype: DTypeLike = np.float32
) -> Laplacian:
    """Prepare the inverse for one image size, boundary and precision (float32 or float64)."""
    if boundary == "dirichlet":
        return SineLaplacian(shape, dtype)
    if cv2.ipp.useIPP() and shape[0] * shape[1] <= _LARGE_PX:
        return DftLaplacian(shape, dtype)
    return CosineLaplacian(shape, dtype)


class CosineLaplacian:
    """Neumann, by ``scipy.fft``."""

    def __init__(self, shape: tuple[int, int], dtype: DTypeLike = np.float32) -> None:
        rows, columns = (_neumann_eigenvalues(np.arange(n), n) for n in shape)
        self._gain = _inverse(rows[:, None] + columns, dtype)

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        from scipy.fft import dctn, idctn

        spectrum = dctn(rhs, type=2, norm="ortho", overwrite_x=True, workers=1)
        spectrum *= self._gain
        return np.asarray(idctn(spectrum, type=2, norm="ortho", overwrite_x=True, workers=1))


class SineLaplacian:
    """Dirichlet, by ``scipy.fft``."""

    def __init__(self, shape: tuple[int, int], dtype: DTypeLike = np.float32) -> None:
        rows, columns = (_neumann_eigenvalues(np.arange(1, n + 1), n + 1) for n in shape)
        self._gain = _inverse(rows[:, None] + columns, dtype)

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        from scipy.fft import dstn, idstn

        spectrum = dstn(rhs, type=1, norm="ortho", overwrite_x=True, workers=1)
        spectrum *= self._gain
        return np.asarray(idstn(spectrum, type=1, norm="ortho", overwrite_x=True, workers=1))


class DftLaplacian:
    """Neumann, by OpenCV's real DFT."""

    def __init__(self, shape: tuple[int, int], dtype: DTypeLike = np.float32) -> None:
        height, width = shape
        self._rows = CosineRows(width, dtype)
        self._columns = CosineRows(height, dtype)
        across = _neumann_eigenvalues(self._rows.frequencies, width)
        down = _neumann_eigenvalues(self._columns.frequencies, height)
        self._gain = _inverse(across[:, None] + down, dtype)

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        spare, turned = np.empty_like(rhs), np.empty_like(self._gain)
        self._rows.forward(rhs, spare)
        cv2.transpose(rhs, dst=turned)
        turned_spare = spare.reshape(turned.shape)
        self._columns.forward(turned, turned_spare)
        turned *= self._gain
        self._columns.backward(turned, turned_spare)
        cv2.transpose(turned, dst=rhs)
        self._rows.backward(rhs, spare)
        return rhs


class CosineRows:
    """The DCT-II of each row and its inverse, up to the sign and order of the coefficients.

    With the even samples first and the odd ones reversed behind them, a real DFT of the same
    length holds the coefficients k and N − k as the real and imaginary part of its entry k, but
    for a rotation by πk/2N (Makhoul, "A fast cosine transform in one and two dimensions", 1980).
    They stay in that packed place, since a diagonal operator only needs to know
    :attr:`frequencies`.
    """

    def __init__(self, n: int, dtype: DTypeLike) -> None:
        pairs = np.arange(1, (n + 1) // 2)
        self.frequencies = np.zeros(n, int)
        self.frequencies[1 : 2 * len(pairs) : 2] = pairs
        self.frequencies[2 : 2 * len(pairs) + 1 : 2] = n - pairs
        if n % 2 == 0:
            self.frequencies[-1] = n // 2
        turn = np.exp(-0.5j * np.pi * pairs / n)
        self._turn = turn.astype(np.result_type(dtype, np.complex64))
        self._back = self._turn.conj()

    def forward(self, rows: Array, spare: Array) -> None:
        """Replace the rows by their coefficients; ``spare`` is memory of the same shape."""
        half = (rows.shape[1] + 1) // 2
        spare[:, :half] = rows[:, ::2]
        spare[:, half:] = rows[:, 1::2][:, ::-1]
        cv2.dft(spare, dst=rows, flags=cv2.DFT_ROWS)
        self._rotate(rows, self._turn)

    def backward(self, rows: Array, spare: Array) -> None:
        """Replace the coefficients by the rows that have them."""
        half = (rows.shape[1] + 1) // 2
        self._rotate(rows, self._back)
        cv2.dft(rows, dst=spare, flags=cv2.DFT_ROWS | cv2.DFT_INVERSE | cv2.DFT_SCALE)
        rows[:, ::2] = spare[:, :half]
        rows[:, 1::2] = spare[:, half:][:, ::-1]

    def _rotate(self, packed: Array, turn: Array) -> None:
        entries = packed[:, 1 : 1 + 2 * len(turn)].view(turn.dtype)
        np.multiply(entries, turn, out=entries)


def _neumann_eigenvalues(k: Array, n: int) -> Array:
    return np.asarray(2 * np.cos(np.pi * k / n) - 2)


def _inverse(eigenvalues: Array, dtype: DTypeLike) -> Array:
    # the constant, which no slope sees, is set to 0
    free = eigenvalues > -1e-15
    return np.where(free, 0, 1 / np.where(free, 1, eigenvalues)).astype(dtype)
