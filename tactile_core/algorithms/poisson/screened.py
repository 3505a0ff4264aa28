"""The screened Poisson equation on a small grid with a free border."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tactile_core.algorithms.arrays.types import Array


class SCREENED:
    """Parameters of the iterative solution. Nothing sets them: they trade time for digits."""

    # [ratio] Norm of the preconditioned residual over that of the source. Source: by hand, :
    # heights of presses differ by less than 0.1 µm from those at 1e-6.
    tolerance = 5e-3
    most_rounds = 60  # [count] Upper bound of the iterations, of which 3 to 6 are usual


# Keeps the equation of a constant solvable where no cell has a weight.
_TINY = float(np.finfo(np.float64).tiny)


def solve_screened(source: Array, weight: Array) -> Array:
    """Solve ``weight · z − Σ (neighbour − z) = source``.

    It minimises the squared differences of neighbours plus ``weight · (z − source / weight)²``.
    Conjugate gradients [1]_ run on the coefficients of the cosine transform, where the differences
    are a diagonal matrix, and are preconditioned by the same equation with the mean weight. On
    small grids that transform is fastest as a matrix product.

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
    (down, across, up, back), modes = _prepared(source.shape)
    gain = 1 / (modes + max(float(weight.sum()) / weight.size, _TINY))

    def applied(z: Array) -> Array:
        weighted = up @ z @ across
        weighted *= weight
        weighted = down @ weighted @ back
        weighted += modes * z
        return np.asarray(weighted)

    residual = down @ np.asarray(source, np.float64) @ back
    step = gain * residual
    energy = float(np.vdot(residual, step))
    enough = SCREENED.tolerance**2 * energy
    z = np.zeros(source.shape)
    direction = step
    for _ in range(SCREENED.most_rounds):
        if not energy > enough:
            break
        change = applied(direction)
        length = energy / float(np.vdot(direction, change))
        z += length * direction
        change *= length
        residual -= change
        step = gain * residual
        before, energy = energy, float(np.vdot(residual, step))
        direction = step + (energy / before) * direction
    return np.asarray(up @ z @ across)


@lru_cache(maxsize=16)
def _prepared(shape: tuple[int, int]) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """Return the cosine transforms along both axes, their transposes, and the stiffness."""
    down, across = (_cosines(side) for side in shape)
    back = np.ascontiguousarray(down.T), np.ascontiguousarray(across.T)
    return (down, across, *back), _stiffness(*shape)


@lru_cache(maxsize=16)
def _cosines(side: int) -> Array:
    """Orthonormal DCT-II as a (side, side) matrix."""
    k = np.arange(side)
    matrix = np.cos(np.pi * k[:, None] * (k + 0.5) / side) * np.sqrt(2 / side)
    matrix[0] /= np.sqrt(2)
    return np.asarray(matrix)


@lru_cache(maxsize=16)
def _stiffness(rows: int, columns: int) -> Array:
    """Factor of each coefficient when the differences to neighbours are summed, (rows, columns)."""
    down, across = (2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in (rows, columns))
    return np.asarray(down[:, None] + across)
