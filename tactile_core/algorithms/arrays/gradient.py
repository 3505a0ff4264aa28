"""Gradients of images."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float32


def gradient(
    image: NDArray[Any], spacing: float = 1.0, *, smooth: bool = False
) -> tuple[Float32, Float32]:
    """Partial derivatives of each channel.

    Parameters
    ----------
    image : (H, W) or (H, W, K) float32
    spacing : float
        Distance of neighbouring pixels.
    smooth : bool
        Average three neighbouring differences with weights 1 : 2 : 1 (Sobel operator).

    Returns
    -------
    along, down : float32, same shape
        Derivative to the right and downwards, per unit of ``spacing``.
    """
    size, weight = (3, 0.125) if smooth else (1, 0.5)
    image = np.asarray(image, np.float32)
    scale = weight / spacing
    along, down = (
        np.asarray(cv2.Sobel(image, cv2.CV_32F, *order, ksize=size, scale=scale), np.float32)
        for order in ((1, 0), (0, 1))
    )
    return along.reshape(image.shape), down.reshape(image.shape)


def steepness(image: Float32, spacing: float = 1.0, *, smooth: bool = False) -> Float32:
    """Magnitude of the :func:`gradient` of an (H, W) image, (H, W)."""
    return np.asarray(cv2.magnitude(*gradient(image, spacing, smooth=smooth)), np.float32)
