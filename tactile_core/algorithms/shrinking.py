"""Images made smaller by the mean over an area, with as many channels as there are lamps."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_MOST_CHANNELS = 4
"""OpenCV shrinks no more at once, unless by a whole factor."""


def shrunk(image: NDArray[Any], size_px: tuple[int, int]) -> NDArray[Any]:
    """Shrink an image; each pixel becomes the mean over the area that it covers.

    Parameters
    ----------
    image : (H, W) or (H, W, K) uint8, uint16, float32 or float64
        Any number of channels.
    size_px : (width, height)
        Of the result, not larger than the image.

    Returns
    -------
    (height, width) or (height, width, K), same dtype
    """
    channels = image.shape[2:]
    planes = [image] if image.ndim == 2 or channels[0] <= _MOST_CHANNELS else cv2.split(image)
    small = [cv2.resize(plane, size_px, interpolation=cv2.INTER_AREA) for plane in planes]
    whole = small[0] if len(small) == 1 else np.dstack(small)
    return np.asarray(whole).reshape(size_px[1], size_px[0], *channels)
