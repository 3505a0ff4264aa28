"""Unit normals and slopes."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32

# [ratio] Largest length of the x and y components that slope models return: the sine of 78.5°.
# Steeper normals keep their direction. Stored models and their tables are made with it.
STEEPEST_SINE = 0.98


def to_normal_xy(gradients: Float32) -> Float32:
    """Components of unit normals from (..., 2) slopes."""
    norm = np.sqrt(1 + (gradients * gradients).sum(-1, keepdims=True))
    return np.asarray(gradients / norm, np.float32)


def planes_to_gradient(nx: Float32, ny: Float32) -> None:
    """Convert two planes of normal components to slopes in place.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Components of the unit normals; overwritten by the slopes.
    """
    square = np.asarray(cv2.multiply(nx, nx), np.float32)
    cv2.accumulateSquare(ny, square)
    # Finding the maximum is much faster than a mask, and few images have a pixel that is too steep.
    if cv2.minMaxLoc(square)[1] > STEEPEST_SINE**2:
        steep = np.nonzero(square > STEEPEST_SINE**2)
        shrink = np.float32(STEEPEST_SINE) / np.sqrt(square[steep])
        nx[steep] *= shrink
        ny[steep] *= shrink
        square[steep] = STEEPEST_SINE**2
    per_cosine = cv2.pow(cv2.addWeighted(square, -1.0, square, 0.0, 1.0), -0.5)
    cv2.multiply(nx, per_cosine, dst=nx)
    cv2.multiply(ny, per_cosine, dst=ny)
