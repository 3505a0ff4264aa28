"""Continues an image smoothly into its unknown parts."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool


def filled(image: Array, known: Bool) -> Array:
    """Fill unknown pixels from the known ones around them.

    Each unknown pixel is interpolated in the finest of ever coarser images, made of the known
    pixels alone, that knows it: small holes are bridged linearly, large ones get smoother towards
    their middle.

    Parameters
    ----------
    image : (H, W) float32 or float64
        Finite; what it holds at unknown pixels does not matter.
    known : (H, W) bool
        True on at least one pixel.

    Returns
    -------
    array of the image's shape and dtype
        A new one; known pixels are untouched.
    """
    return filled_alike([image], known)[0]


def filled_alike(images: Sequence[Array], known: Bool) -> list[Array]:
    """Fill several images that are known at the same pixels; see :func:`filled`."""
    if known.all():
        return [image.copy() for image in images]
    height, width = known.shape
    half = ((width + 1) // 2, (height + 1) // 2)
    mask = known.view(np.uint8)
    share = cv2.resize(known.astype(images[0].dtype), half, interpolation=cv2.INTER_AREA)
    known_coarse = share > 1e-3
    gain = 1 / np.where(known_coarse, share, 1)
    means = []
    for image in images:
        inside = cv2.resize(cv2.copyTo(image, mask), half, interpolation=cv2.INTER_AREA)
        means.append(np.multiply(inside, gain, out=inside))
    results = []
    for image, mean in zip(images, filled_alike(means, known_coarse), strict=True):
        smooth = cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
        results.append(cv2.copyTo(image, mask, smooth))
    return results
