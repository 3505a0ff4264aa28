"""Inverse of the five-point Laplacian on a rectangle by fast transforms.

The cosine transform (DCT-II) diagonalises the Laplacian with a Neumann border, which has no face
out of the image. The sine transform (DST-I) diagonalises it with a Dirichlet border, 0 at the
pixels one step outside [1]_.

References
----------
.. [1] T. Simchony, R. Chellappa and M. Shao, "Direct analytical methods for solving Poisson
   equations in computer vision problems", IEEE Transactions on Pattern Analysis and Machine
   Intelligence 12(5), 1990.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike

from tactile_core.algorithms.arrays.types import Array

Boundary = Literal["neumann", "dirichlet"]

_ZERO = 1e-15  # [ratio] Eigenvalues above minus this are that of the free constant


class Laplacian:
    """Invertible Laplacian of one image size; immutable, so several threads may use it at once.

    Parameters
    ----------
    shape : (height, width) in px
    boundary : "neumann" or "dirichlet"
    dtype : float32 or float64
    """

    def __init__(
        self, shape: tuple[int, int], boundary: Boundary, dtype: DTypeLike = np.float32
    ) -> None:
        self._boundary = boundary
        first = 0 if boundary == "neumann" else 1
        rows, columns = (_eigenvalues(np.arange(n) + first, n + first) for n in shape)
        eigenvalues = rows[:, None] + columns
        # the constant, which has no slope, is set to 0
        free = eigenvalues > -_ZERO
        self._gain = np.where(free, 0, 1 / np.where(free, 1, eigenvalues)).astype(dtype)

    def solve(self, rhs: Array) -> Array:
        """Solve L z = rhs with L z = Σ (neighbour − z).

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
        from scipy import fft

        cosine, sine = (fft.dctn, fft.idctn, 2), (fft.dstn, fft.idstn, 1)
        forward, backward, kind = cosine if self._boundary == "neumann" else sine
        how: dict[str, Any] = {"type": kind, "norm": "ortho", "overwrite_x": True, "workers": 1}
        spectrum = forward(rhs, **how)
        spectrum *= self._gain
        return np.asarray(backward(spectrum, **how))


@lru_cache(maxsize=8)
def laplacian(
    shape: tuple[int, int], boundary: Boundary, dtype: DTypeLike = np.float32
) -> Laplacian:
    """Return the Laplacian of an image size, boundary and precision, which is kept."""
    return Laplacian(shape, boundary, dtype)


def _eigenvalues(k: Array, n: int) -> Array:
    return np.asarray(2 * np.cos(np.pi * k / n) - 2)
