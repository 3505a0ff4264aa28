"""Unknown pixels, and gradients of images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Bool, Float32


class FILLING:
    """Parameters of filling. Nothing sets them from outside: they depend on no image."""

    # [share of a pixel] A pixel of a coarser image is known if more than this of its area is.
    # Source: by hand, just above rounding.
    least_share = 1e-3


def fill_unknown(image: Array, known: Bool) -> Array:
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
    """Fill several images whose known pixels are the same; see :func:`fill_unknown`."""
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
