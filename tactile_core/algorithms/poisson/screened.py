"""A screened Poisson equation on few cells, and the cosine waves that solve it."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float64


def solve_screened(source: Array, weight: Array) -> Float64:
    """Solve ``weight · z − Σ (neighbour − z) = source`` by conjugate gradients.

    It minimises the squared differences of neighbours plus ``weight · (z − source / weight)²``. The
    preconditioner is the exact solution for the mean weight, by cosine transforms. A banded
    factorisation takes as long, but starts the threads of LAPACK, which wait for each other for
    up to a second where other programs are busy.

    Parameters
    ----------
    source : (h, w) float64
    weight : (h, w) float64
        Not negative.

    Returns
    -------
    (h, w) float64
        z.
    """
    (down, of_down), (across, of_across) = (cosines(n) for n in source.shape)
    # [weight] no division by zero
    inverse = 1 / (differences(of_down, of_across) + max(weight.mean(), 1e-9))

    def precondition(residual: Float64) -> Float64:
        # for so few cells, products of matrices take a third of the time of fast transforms
        return np.asarray(down.T @ ((down @ residual @ across.T) * inverse) @ across)

    z, residual = np.zeros(source.shape), source.astype(np.float64)
    direction = solved = precondition(residual)
    left = float(np.vdot(residual, solved))
    enough = 1e-2**2 * left  # [ratio] far below the errors of slopes
    for _ in range(30):  # [rounds] contacts take 4 to 6
        if left <= enough:
            break
        neighbours = cv2.Laplacian(direction, -1, ksize=1, borderType=cv2.BORDER_REPLICATE)
        image = weight * direction - neighbours
        step = left / float(np.vdot(direction, image))
        z += step * direction
        residual -= step * image
        solved = precondition(residual)
        before, left = left, float(np.vdot(residual, solved))
        direction = solved + left / before * direction
    return z


@lru_cache(maxsize=16)
def cosines(count: int, margin: int = 0) -> tuple[Float64, Float64]:
    """Return the orthonormal cosines of a side of cells, and their wave numbers per cell.

    Parameters
    ----------
    count : int
        Cells.
    margin : int
        Cells beyond each end that belong to the side, but are not in the result.

    Returns
    -------
    waves : (count + 2 · margin, count) float64
        One a row.
    wave_numbers : (count + 2 · margin,) float64
    """
    whole = count + 2 * margin
    wave_numbers = np.pi * np.arange(whole) / whole
    rows = np.sqrt(2 / whole) * np.cos(np.outer(wave_numbers, np.arange(count) + margin + 0.5))
    rows[0] = np.sqrt(1 / whole)
    return rows, wave_numbers


def differences(down: Float64, across: Float64) -> Float64:
    """Return the factors of cosines of these wave numbers under ``Σ (z − neighbour)``."""
    return np.asarray(np.add.outer(2 - 2 * np.cos(down), 2 - 2 * np.cos(across)))
