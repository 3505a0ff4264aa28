"""Gradient of an image by central differences, mirrored at its border."""

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
    if not smooth:
        along, down = _differences(np.ascontiguousarray(image, np.float32))
        scale = np.float32(0.5 / spacing)
        along *= scale
        down *= scale
        return along, down
    along, down = (
        np.asarray(cv2.Sobel(image, cv2.CV_32F, *order, scale=0.125 / spacing), np.float32)
        for order in ((1, 0), (0, 1))
    )
    return along.reshape(image.shape), down.reshape(image.shape)


def _differences(image: Float32) -> tuple[Float32, Float32]:
    """Differences of the next and the last pixel to the right and downwards; 0 at the border."""
    along, down = np.empty_like(image), np.empty_like(image)
    wide = image.shape[2] if image.ndim == 3 else 1
    flat = image.reshape(-1)
    # rows follow each other, so that only their ends, which are set below, are wrong
    np.subtract(flat[2 * wide :], flat[: -2 * wide], out=along.reshape(-1)[wide:-wide])
    along[:, 0] = along[:, -1] = 0
    np.subtract(image[2:], image[:-2], out=down[1:-1])
    down[0] = down[-1] = 0
    return along, down


def steepness(image: Float32, spacing: float = 1.0, *, smooth: bool = False) -> Float32:
    """Magnitude of the :func:`gradient` of an (H, W) image, (H, W)."""
    return np.asarray(cv2.magnitude(*gradient(image, spacing, smooth=smooth)), np.float32)
