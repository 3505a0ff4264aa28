"""Continues an image smoothly into its unknown parts."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Bool = NDArray[np.bool_]


def filled(image: Array, known: Bool, *, coarse_px: int = 2) -> Array:
    """Fill unknown pixels from the known ones around them.

    Each unknown pixel takes the value of a coarser image, made of the known pixels alone, at the
    first scale that knows it; values are interpolated linearly, so that small holes are bridged
    smoothly and large ones get ever smoother towards their middle.

    Parameters
    ----------
    image : (H, W) or (H, W, 2…4) float32 or float64
        Anything finite where it is not known.
    known : (H, W) bool
        True on at least one pixel.
    coarse_px : int
        Side of the first coarser pixel; the next ones double.

    Returns
    -------
    array of the image's shape and dtype
        A new one; known pixels are untouched.
    """
    weight = known.view(np.uint8)
    result = image.copy()
    if not weight.all():
        cv2.copyTo(_continued(image, weight, coarse_px), 1 - weight, result)
    return result


def _continued(image: Array, weight: Array, step: int) -> Array:
    """Everywhere-known smooth image that agrees with the known pixels of ``image``."""
    height, width = weight.shape
    size = (-(-width // step), -(-height // step))
    inside = cv2.copyTo(image, weight)
    share = cv2.resize(weight.astype(image.dtype), size, interpolation=cv2.INTER_AREA)
    mean = cv2.resize(inside, size, interpolation=cv2.INTER_AREA)
    known = share > 1e-3
    divisor = np.where(known, share, 1)
    mean /= divisor.reshape(divisor.shape + (1,) * (image.ndim - 2))
    if not known.all():
        mean = filled(mean, known)
    return cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
