"""Smooth interpolation of an image into its unknown parts."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool


class FILLING:
    """Parameters of filling. Nothing sets them from outside: they depend on no image."""

    # [share of a pixel] A pixel of a coarser image is known if more than this of its area is.
    # Source: by hand, just above rounding.
    least_share = 1e-3


def filled(image: Array, known: Bool) -> Array:
    """Fill unknown pixels from the known ones around them.

    A pyramid of ever coarser images is made of the known pixels alone (pull), and each unknown
    pixel is interpolated in the finest level that knows it (push) [1]_. Small holes are bridged
    linearly; the fill of large ones gets smoother towards their middle.

    Parameters
    ----------
    image : (H, W) float32 or float64
        Finite. The values of unknown pixels do not matter.
    known : (H, W) bool
        True on at least one pixel.

    Returns
    -------
    (H, W), same dtype
        A new array; known pixels keep their value.

    References
    ----------
    .. [1] S. J. Gortler, R. Grzeszczuk, R. Szeliski and M. F. Cohen, "The Lumigraph", SIGGRAPH,
       1996 (pull-push).
    """
    return filled_together([image], known)[0]


def filled_together(images: Sequence[Array], known: Bool) -> list[Array]:
    """Fill several images whose known pixels are the same; see :func:`filled`."""
    if known.all():
        return [image.copy() for image in images]
    height, width = known.shape
    half = ((width + 1) // 2, (height + 1) // 2)
    mask = known.view(np.uint8)
    share = cv2.resize(known.astype(images[0].dtype), half, interpolation=cv2.INTER_AREA)
    known_coarse = share > FILLING.least_share
    gain = 1 / np.where(known_coarse, share, 1)
    means = []
    for image in images:
        inside = cv2.resize(cv2.copyTo(image, mask), half, interpolation=cv2.INTER_AREA)
        means.append(np.multiply(inside, gain, out=inside))
    results = []
    for image, mean in zip(images, filled_together(means, known_coarse), strict=True):
        smooth = cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR)
        results.append(cv2.copyTo(image, mask, smooth))
    return results
