"""Images of fewer pixels, each the mean of those that it stands for."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


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
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
