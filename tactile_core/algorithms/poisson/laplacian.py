"""Inverse of the five-point Laplacian on a rectangle, by fast transforms.

Neumann: no face at the border counts; the cosine transform (DCT-II) diagonalises it. Dirichlet:
0 at the pixels one step outside the border; the sine transform (DST-I) diagonalises it.

The cosine transform is made of OpenCV's real DFT where OpenCV has a fast one: as fast as
``scipy.fft``, and without its import, which takes half as long as a whole run on one image. Else,
and for the sine transform, ``scipy.fft`` does it. With the compiled kernels only the rows are
transformed; see :mod:`tactile_core.algorithms.poisson.tridiagonal`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, Protocol

import cv2
import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.poisson.cosines import CosineRows, from_dft_order, in_dft_order
from tactile_core.algorithms.poisson.tridiagonal import TridiagonalLaplacian

Boundary = Literal["neumann", "dirichlet"]

_BAND_PX = 80_000
_LARGE_PX = 1_000_000
"""Beyond it the many passes of :class:`DftLaplacian` fall out of the cache."""


class Laplacian(Protocol):
    """A Laplacian that can be inverted, by several threads at once; immutable."""

    def solve(self, rhs: Array) -> Array:
        """Return the (H, W) z of L z = rhs, L z = Σ (neighbour − z), in the memory of rhs.

        "neumann" takes the mean off rhs, and gives a z of mean 0.
        """
        ...


def laplacian(
    shape: tuple[int, int],
    boundary: Boundary,
    dtype: DTypeLike = np.float32,
    *,
    compiled: bool = False,
) -> Laplacian:
    """Return the inverse for one image size, boundary and precision (float32 or float64).

    ``compiled`` uses :mod:`tactile_core.algorithms.kernels`, for float32 with a free border.
    """
    dtype = np.dtype(dtype)
    suits = boundary == "neumann" and dtype == np.float32
    return _prepared(shape, boundary, dtype, suits and kernels.chosen(compiled) is not None)


@lru_cache(maxsize=8)
def _prepared(
    shape: tuple[int, int], boundary: Boundary, dtype: np.dtype[Any], compiled: bool
) -> Laplacian:
    if compiled:
        return TridiagonalLaplacian(shape)
    if boundary == "neumann" and cv2.ipp.useIPP() and shape[0] * shape[1] <= _LARGE_PX:
        return DftLaplacian(shape, dtype)
    return FftLaplacian(shape, boundary, dtype)


class FftLaplacian:
    """By ``scipy.fft``: of cosines (DCT-II) for Neumann, of sines (DST-I) for Dirichlet."""

    def __init__(
        self,
        shape: tuple[int, int],
        boundary: Boundary = "neumann",
        dtype: DTypeLike = np.float32,
    ) -> None:
        self._boundary = boundary
        first = 0 if boundary == "neumann" else 1
        rows, columns = (_eigenvalues(np.arange(n) + first, n + first) for n in shape)
        self._gain = _inverse(rows[:, None] + columns, dtype)

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        from scipy import fft

        cosines, normal_xy = (fft.dctn, fft.idctn, 2), (fft.dstn, fft.idstn, 1)
        forward, backward, kind = cosines if self._boundary == "neumann" else normal_xy
        how: dict[str, Any] = {"type": kind, "norm": "ortho", "overwrite_x": True, "workers": 1}
        spectrum = forward(rhs, **how)
        spectrum *= self._gain
        return np.asarray(backward(spectrum, **how))


class DftLaplacian:
    """Neumann, by OpenCV's real DFT."""

    def __init__(self, shape: tuple[int, int], dtype: DTypeLike = np.float32) -> None:
        self._down, self._across = (CosineRows(n, dtype) for n in shape)
        down, across = (
            _eigenvalues(rows.frequencies, rows.length) for rows in (self._down, self._across)
        )
        self._gain = _inverse(down[:, None] + across, dtype, scale=1 / (shape[0] * shape[1]))

    def solve(self, rhs: Array) -> Array:
        """Return the z of L z = rhs."""
        height, width = rhs.shape
        down = self._down
        with (
            borrowed((height, width), rhs.dtype) as spare,
            borrowed((width, down.room), rhs.dtype) as memory,
        ):
            turned, spare_turned = rhs.reshape(width, height), spare.reshape(width, height)
            # The samples of a column are brought into their order as whole rows, and then turned.
            in_dft_order(rhs, spare)
            cv2.transpose(spare, dst=turned)
            for band in _bands(turned):
                down.forward(turned[band], memory[band])
            in_dft_order(down.coefficients(memory), spare_turned)
            cv2.transpose(spare_turned, dst=rhs)
            self._divide(rhs)
            cv2.transpose(rhs, dst=spare_turned)
            from_dft_order(spare_turned, down.coefficients(memory))
            for band in _bands(turned):
                down.backward(memory[band], turned[band])
            cv2.transpose(turned, dst=spare)
            from_dft_order(spare, rhs)
        return rhs

    def _divide(self, rows: Array) -> None:
        """Divide what each row is made of by its eigenvalue."""
        across = self._across
        bands = _bands(rows)
        with borrowed((bands[0].stop, across.room), rows.dtype) as memory:
            for band in bands:
                some = memory[: band.stop - band.start]
                across.forward(rows[band], some)
                across.coefficients(some)[:] *= self._gain[band]
                across.backward(some, rows[band])


def _bands(rows: Array) -> list[slice]:
    """The rows in portions that stay in the cache while they are worked on."""
    count = max(1, _BAND_PX // rows.shape[1])
    return [slice(i, min(i + count, len(rows))) for i in range(0, len(rows), count)]


def _eigenvalues(k: Array, n: int) -> Array:
    return np.asarray(2 * np.cos(np.pi * k / n) - 2)


def _inverse(eigenvalues: Array, dtype: DTypeLike, scale: float = 1.0) -> Array:
    # the constant, which no slope sees, is set to 0
    free = eigenvalues > -1e-15
    return np.where(free, 0, scale / np.where(free, 1, eigenvalues)).astype(dtype)
