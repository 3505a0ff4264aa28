"""The screened Poisson equation on a small grid with a free border."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Array


class ScreenedParameters(NamedTuple):
    """Parameters of the iterative solution. Nothing sets them: they trade time for digits.

    Attributes
    ----------
    tolerance : float, ratio
        Norm of the preconditioned residual over that of the source.
        Source: chosen by hand: heights differ by less than 0.1 % from those at 1e-6.
    most_rounds : int, count
        Upper bound of the iterations, of which 5 to 11 are usual.
        Source: chosen by hand; no script derives it.
    """

    tolerance: float = 1e-3
    most_rounds: int = 60


SCREENED = ScreenedParameters()
"""The values in use."""


def solve_screened(source: Array, weight: Array) -> Array:
    """Solve ``weight · z − Σ (neighbour − z) = source``.

    It minimises the squared differences of neighbours plus ``weight · (z − source / weight)²``.
    Conjugate gradients [1]_ are preconditioned by the same equation with the mean weight, which the
    cosine transform solves exactly. On small grids that transform is fastest as a matrix product.

    Parameters
    ----------
    source : (H, W)
    weight : (H, W)
        Not negative, and positive somewhere. The fewer iterations, the more even it is.

    Returns
    -------
    (H, W) float64
        z.

    References
    ----------
    .. [1] M. R. Hestenes and E. Stiefel, "Methods of conjugate gradients for solving linear
       systems", Journal of Research of the National Bureau of Standards 49(6), 1952.
    """
    down, across = (_cosines(side) for side in source.shape)
    modes = _stiffness(source.shape[0])[:, None] + _stiffness(source.shape[1])
    gain = 1 / np.maximum(weight.mean() + modes, np.finfo(np.float64).tiny)

    def preconditioned(residual: Array) -> Array:
        return np.asarray(down.T @ ((down @ residual @ across.T) * gain) @ across)

    z, residual = np.zeros(source.shape), np.asarray(source, np.float64)
    direction = step = preconditioned(residual)
    energy = first = np.vdot(residual, step)
    for _ in range(SCREENED.most_rounds):
        if not energy > SCREENED.tolerance**2 * first:
            break
        applied = weight * direction - _laplacian_of(direction)
        length = energy / np.vdot(direction, applied)
        z += length * direction
        residual = residual - length * applied
        step = preconditioned(residual)
        before, energy = energy, np.vdot(residual, step)
        direction = step + (energy / before) * direction
    return z


def _laplacian_of(z: Array) -> Array:
    total = np.zeros_like(z)
    across, down = np.diff(z, axis=1), np.diff(z, axis=0)
    total[:, :-1] += across
    total[:, 1:] -= across
    total[:-1] += down
    total[1:] -= down
    return total


@lru_cache(maxsize=16)
def _cosines(side: int) -> Array:
    """Orthonormal DCT-II as a (side, side) matrix."""
    k = np.arange(side)
    matrix = np.cos(np.pi * k[:, None] * (k + 0.5) / side) * np.sqrt(2 / side)
    matrix[0] /= np.sqrt(2)
    return np.asarray(matrix)


def _stiffness(side: int) -> Array:
    return np.asarray(2 - 2 * np.cos(np.pi * np.arange(side) / side))
