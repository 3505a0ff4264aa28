"""Inverse of the five-point Laplacian on a rectangle by fast transforms.

The cosine transform (DCT-II) diagonalises the Laplacian with a Neumann border, which has no face
out of the image. The sine transform (DST-I) diagonalises it with a Dirichlet border, 0 at the
pixels one step outside [1]_.

The cosine transform uses OpenCV's real DFT where OpenCV has a fast one. It is as fast as
``scipy.fft`` and needs no import of it, which takes half as long as a whole run on one image.
Otherwise, and for the sine transform, ``scipy.fft`` is used. With the compiled kernels only the
rows are transformed; see :mod:`tactile_core.algorithms.poisson.tridiagonal`.

References
----------
.. [1] T. Simchony, R. Chellappa and M. Shao, "Direct analytical methods for solving Poisson
   equations in computer vision problems", IEEE Transactions on Pattern Analysis and Machine
   Intelligence 12(5), 1990.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, NamedTuple, Protocol

import cv2
import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.scratch import borrowed
from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.poisson.cosines import CosineRows, from_dft_order, in_dft_order
from tactile_core.algorithms.poisson.tridiagonal import TridiagonalLaplacian

Boundary = Literal["neumann", "dirichlet"]


class LaplacianParameters(NamedTuple):
    """Parameters that fit the transforms to the processor's cache; results differ by rounding.

    Attributes
    ----------
    band_px : int, px²
        Pixels that are transformed together.
        Source: chosen by hand; no script derives it.
    large_px : int, px²
        Beyond it ``scipy.fft`` is used, since :class:`DftLaplacian` passes over the image often
        enough to leave the cache.
        Source: chosen by hand; no script derives it.
    zero_eigenvalue : float, ratio
        Eigenvalues above minus this are that of the free constant.
        Source: chosen by hand, just above rounding; no script derives it.
    """

    band_px: int = 80_000
    large_px: int = 1_000_000
    zero_eigenvalue: float = 1e-15


LAPLACIAN = LaplacianParameters()
"""The values in use."""


class Laplacian(Protocol):
    """Invertible Laplacian; immutable, so several threads may use it at once."""

    def solve(self, rhs: Array) -> Array:
        """Solve L z = rhs with L z = Σ (neighbour − z), in the memory of ``rhs``.

        With a Neumann border the mean of ``rhs`` is removed and that of z is 0.

        Parameters
        ----------
        rhs : (H, W)
            Overwritten.

        Returns
        -------
        (H, W)
            z.
        """
        ...


def laplacian(
    shape: tuple[int, int],
    boundary: Boundary,
    dtype: DTypeLike = np.float32,
    *,
    compiled: bool = False,
) -> Laplacian:
    """Return the fastest Laplacian for an image size, boundary and precision.

    Parameters
    ----------
    shape : (height, width) in px
    boundary : "neumann" or "dirichlet"
    dtype : float32 or float64
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`, for float32 with a free border.
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
    small = shape[0] * shape[1] <= LAPLACIAN.large_px
    if boundary == "neumann" and cv2.ipp.useIPP() and small:
        return DftLaplacian(shape, dtype)
    return FftLaplacian(shape, boundary, dtype)


class FftLaplacian:
    """Laplacian by ``scipy.fft``: DCT-II for Neumann, DST-I for Dirichlet."""

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

        cosine, sine = (fft.dctn, fft.idctn, 2), (fft.dstn, fft.idstn, 1)
        forward, backward, kind = cosine if self._boundary == "neumann" else sine
        how: dict[str, Any] = {"type": kind, "norm": "ortho", "overwrite_x": True, "workers": 1}
        spectrum = forward(rhs, **how)
        spectrum *= self._gain
        return np.asarray(backward(spectrum, **how))


class DftLaplacian:
    """Laplacian with a Neumann border by OpenCV's real DFT."""

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
            # Samples of columns are reordered as whole rows, and then transposed.
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
        """Divide the spectrum of each row by the eigenvalues."""
        across = self._across
        bands = _bands(rows)
        with borrowed((bands[0].stop, across.room), rows.dtype) as memory:
            for band in bands:
                spectrum = memory[: band.stop - band.start]
                across.forward(rows[band], spectrum)
                across.coefficients(spectrum)[:] *= self._gain[band]
                across.backward(spectrum, rows[band])


def _bands(rows: Array) -> list[slice]:
    """Split the rows into bands that stay in the cache while they are processed."""
    count = max(1, LAPLACIAN.band_px // rows.shape[1])
    return [slice(i, min(i + count, len(rows))) for i in range(0, len(rows), count)]


def _eigenvalues(k: Array, n: int) -> Array:
    return np.asarray(2 * np.cos(np.pi * k / n) - 2)


def _inverse(eigenvalues: Array, dtype: DTypeLike, scale: float = 1.0) -> Array:
    # the constant, which has no slope, is set to 0
    free = eigenvalues > -LAPLACIAN.zero_eigenvalue
    return np.where(free, 0, scale / np.where(free, 1, eigenvalues)).astype(dtype)
