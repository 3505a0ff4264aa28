"""Images of fewer pixels, each the mean of those that it stands for."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

_MOST_CHANNELS = 4
"""OpenCV averages more only over squares."""


def shrunk(image: Array, size: tuple[int, int], *, halvings: int = 8) -> Array:
    """Area means of a (H, W) or (H, W, K) image, ``size`` = (width, height).

    Halving is vectorised and an average by any other number is not, so that as many ``halvings`` as
    divide the image exactly come first. Whole numbers are rounded at each, floats not noticeably.
    """
    for _ in range(halvings):
        rows, columns = image.shape[:2]
        if rows % (2 * size[1]) or columns % (2 * size[0]):
            break
        image = np.asarray(
            cv2.resize(image, (columns // 2, rows // 2), interpolation=cv2.INTER_AREA)
        )
    if image.shape[1::-1] == size:
        return image
    if image.ndim == 3 and image.shape[2] > _MOST_CHANNELS:
        planes = [shrunk(image[..., k], size, halvings=0) for k in range(image.shape[2])]
        return np.stack(planes, axis=2)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
