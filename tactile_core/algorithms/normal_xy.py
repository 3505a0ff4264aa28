"""Slopes as sines: the horizontal part of the unit normal, turned uphill.

A sine is bounded where a slope is not, so that models are fitted, averaged and corrected as sines
and become slopes last: one model that is unsure cannot pull the mean to a cliff.
"""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Float32

STEEPEST_SINE = 0.98
"""Sine of the steepest slope that a model may claim, 78°."""


def to_gradient(normal_xy: Float32) -> Float32:
    """Slopes ∂z/∂(x, y) from (..., 2) sines; steeper ones keep their direction at the steepest."""
    square = (normal_xy * normal_xy).sum(-1, keepdims=True)
    excess = np.maximum(square, STEEPEST_SINE**2) / STEEPEST_SINE**2
    bounded = normal_xy / np.sqrt(excess)
    return np.asarray(bounded / np.sqrt(1 - np.minimum(square, STEEPEST_SINE**2)), np.float32)


def to_normal_xy(gradients: Float32) -> Float32:
    """Sines from (..., 2) slopes; the inverse of :func:`to_gradient`."""
    norm = np.sqrt(1 + (gradients * gradients).sum(-1, keepdims=True))
    return np.asarray(gradients / norm, np.float32)


def planes_to_gradient(nx: Float32, ny: Float32, scratch: Float32) -> None:
    """Turn two (H, W) planes of sines into slopes in place; :func:`to_gradient` for whole images.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Sines; overwritten by slopes.
    scratch : (H, W) float32
        Overwritten.
    """
    square = cv2.multiply(nx, nx, dst=scratch)
    cv2.accumulateSquare(ny, square)
    # The steepest is found much faster than where it is, and hardly any pixel is too steep.
    if cv2.minMaxLoc(square)[1] > STEEPEST_SINE**2:
        steep = np.nonzero(scratch > STEEPEST_SINE**2)
        shrink = np.float32(STEEPEST_SINE) / np.sqrt(scratch[steep])
        nx[steep] *= shrink
        ny[steep] *= shrink
        scratch[steep] = STEEPEST_SINE**2
    cv2.addWeighted(scratch, -1.0, scratch, 0.0, 1.0, dst=scratch)
    per_cosine = cv2.pow(scratch, -0.5, dst=scratch)
    cv2.multiply(nx, per_cosine, dst=nx)
    cv2.multiply(ny, per_cosine, dst=ny)
