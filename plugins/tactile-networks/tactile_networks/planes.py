"""The planes that a network sees."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32


def shrunk_planes(values: Array, size: tuple[int, int]) -> Float32:
    """Resize planes: by area where they shrink, and linearly where they grow.

    Parameters
    ----------
    values : (H, W) or (H, W, K)
    size : (width, height)

    Returns
    -------
    (height, width, K) float32
    """
    height, width = values.shape[:2]
    shrinks = size[0] <= width and size[1] <= height
    found = cv2.resize(
        np.asarray(values, np.float32),
        size,
        interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR,
    )
    return np.asarray(found, np.float32).reshape(size[1], size[0], -1)


def normalise_planes(
    planes: Float32,
    divisor: Float32 | float = 1.0,
    mean: Sequence[float] | float = 0.0,
    std: Sequence[float] | float = 1.0,
) -> Float32:
    """(H, W, K) ``(planes / divisor - mean) / std``, each a number or one number per plane."""
    scale = 1 / (np.asarray(divisor, np.float32) * np.asarray(std, np.float32))
    shift = np.asarray(mean, np.float32) / np.asarray(std, np.float32)
    return np.asarray(planes * scale - shift, np.float32)


def tensor(planes: Sequence[Float32], order: str = "nchw") -> Float32:
    """Stack groups of planes, each (H, W, K), to a contiguous tensor of one observation.

    Parameters
    ----------
    planes : sequence of (H, W, K) float32
    order : "nchw" or "nhwc"
    """
    stacked = np.concatenate(planes, axis=2)
    if order == "nchw":
        stacked = stacked.transpose(2, 0, 1)
    return np.ascontiguousarray(stacked[None], np.float32)
