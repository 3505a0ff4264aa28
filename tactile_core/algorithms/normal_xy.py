"""Slopes as x and y components of the unit normal.

The components are those of the horizontal part of the unit normal, pointing uphill: their length is
the sine of the slope angle. They are bounded and slopes are not. So models are fitted, averaged and
corrected in ``normal_xy`` and converted to slopes at the end; one uncertain model cannot pull the
mean towards a vertical wall.
"""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32


class NORMALS:
    """Bound of the normals that slope models return.

    Nothing sets it from outside: stored models and their tables are made with it.
    """

    # [ratio] Largest length of ``normal_xy``, the sine of 78.5°. Steeper normals keep their
    # direction.
    steepest_sine = 0.98


def to_gradient(normal_xy: Float32) -> Float32:
    """Slopes from the x and y components of unit normals.

    Parameters
    ----------
    normal_xy : (..., 2) float32
        Steeper ones than ``NORMALS.steepest_sine`` are shortened to it.

    Returns
    -------
    (..., 2) float32
        ∂z/∂x and ∂z/∂y.
    """
    square = (normal_xy * normal_xy).sum(-1, keepdims=True)
    excess = np.maximum(square, NORMALS.steepest_sine**2) / NORMALS.steepest_sine**2
    bounded = normal_xy / np.sqrt(excess)
    return np.asarray(
        bounded / np.sqrt(1 - np.minimum(square, NORMALS.steepest_sine**2)), np.float32
    )


def to_normal_xy(gradients: Float32) -> Float32:
    """Components of unit normals from (..., 2) slopes; the inverse of :func:`to_gradient`."""
    norm = np.sqrt(1 + (gradients * gradients).sum(-1, keepdims=True))
    return np.asarray(gradients / norm, np.float32)


def planes_to_gradient(nx: Float32, ny: Float32) -> None:
    """Convert two planes of normal components to slopes in place; a faster :func:`to_gradient`.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Components of the unit normals; overwritten by the slopes.
    """
    square = np.asarray(cv2.multiply(nx, nx), np.float32)
    cv2.accumulateSquare(ny, square)
    # Finding the maximum is much faster than a mask, and few images have a pixel that is too steep.
    if cv2.minMaxLoc(square)[1] > NORMALS.steepest_sine**2:
        steep = np.nonzero(square > NORMALS.steepest_sine**2)
        shrink = np.float32(NORMALS.steepest_sine) / np.sqrt(square[steep])
        nx[steep] *= shrink
        ny[steep] *= shrink
        square[steep] = NORMALS.steepest_sine**2
    per_cosine = cv2.pow(cv2.addWeighted(square, -1.0, square, 0.0, 1.0), -0.5)
    cv2.multiply(nx, per_cosine, dst=nx)
    cv2.multiply(ny, per_cosine, dst=ny)
