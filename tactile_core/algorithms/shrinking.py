"""Smaller images by averaging, of any number of channels."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_MOST_CHANNELS = 4
"""Of one call of OpenCV."""


def shrunk(image: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """Average an image down.

    Parameters
    ----------
    image : (H, W, K) uint8, uint16 or float32
    size : (int, int)
        Columns and rows of the result.

    Returns
    -------
    (rows, columns, K), same dtype
    """
    channels = image.shape[2]
    parts = [
        cv2.resize(
            np.ascontiguousarray(image[..., first : first + _MOST_CHANNELS]),
            size,
            interpolation=cv2.INTER_AREA,
        ).reshape(size[1], size[0], -1)
        for first in range(0, channels, _MOST_CHANNELS)
    ]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)
