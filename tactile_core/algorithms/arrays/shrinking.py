"""Images made smaller by the mean over an area, and larger between the middles of cells."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array

MOST_CHANNELS = 4
"""OpenCV shrinks no more at once, unless by a whole factor."""


def shrunk(image: Array, size_px: tuple[int, int], *, halvings: int = 8) -> Array:
    """Shrink an image; each pixel becomes the mean over the area that it covers.

    Parameters
    ----------
    image : (H, W) or (H, W, K) uint8, uint16, float32 or float64
        Any number of channels.
    size_px : (width, height)
        Of the result, not larger than the image.
    halvings : int
        How often the image may be halved first, while that divides it exactly: halving is
        vectorised, an average by another number is not. Integers are rounded each time.

    Returns
    -------
    (height, width) or (height, width, K), same dtype
    """
    channels = image.shape[2:]
    for _ in range(halvings):
        rows, columns = image.shape[:2]
        if rows % (2 * size_px[1]) or columns % (2 * size_px[0]):
            break
        half = columns // 2, rows // 2
        image = np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA))
    if image.shape[1::-1] != size_px:
        wide = image.ndim == 3 and channels[0] > MOST_CHANNELS
        planes = cv2.split(image) if wide else [image]
        small = [cv2.resize(plane, size_px, interpolation=cv2.INTER_AREA) for plane in planes]
        image = np.dstack(small) if wide else np.asarray(small[0])
    return image.reshape(size_px[1], size_px[0], *channels)


def repeated(image: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Enlarge an (h, w) uint8 image to an (H, W) shape; each pixel is the nearest one's."""
    times = shape[0] // image.shape[0]
    if (image.shape[0] * times, image.shape[1] * times) != shape:
        nearest = cv2.resize(image, shape[::-1], interpolation=cv2.INTER_NEAREST)
        return np.asarray(nearest, np.uint8)
    # much faster than any interpolation: channels that are all alike are pixels side by side
    wide = np.asarray(cv2.merge([image] * times), np.uint8).reshape(len(image), -1)
    return np.repeat(wide, times, axis=0)


def enlarged(cells: Array, shape: tuple[int, ...]) -> Array:
    """Enlarge an (h, w, …) grid of cells that tile an image to its (H, W, …), by linear steps.

    A grid of that size is returned as it is.
    """
    if cells.shape[:2] == tuple(shape[:2]):
        return cells
    large = cv2.resize(cells, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR)
    return np.asarray(large).reshape(*shape[:2], *cells.shape[2:])
