"""Whether images in a row show something that moves, or have nothing to do with each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

# Width and height at which images are compared: an imprint still fills some pixels.
_SIZE_PX = 32, 24

# Least ratio of unrelated images: recorded presses have 0.49 or more, grasps 0.25 or less.
_UNRELATED = 0.4

_LEAST_CHANGE = 0.006  # Of full scale. Noise and the light change by less, and are unrelated, too.


def are_unrelated(pairs: Sequence[tuple[NDArray[Any], NDArray[Any]]]) -> bool:
    """Whether neighbouring images differ as much as any two of them.

    The squared difference of neighbours over twice the variance of all, the ratio of von Neumann
    [1]_, is about 1 for images in any order and small for those of a motion. Its lower quartile
    decides, because much may change at once where an object slips, but not all the time. One image
    alone shows no motion either; of two nobody can know; and images that hardly differ are those
    of a gel at rest.

    Parameters
    ----------
    pairs : sequence of two (H, W) or (H, W, 3) uint8 or uint16
        Each an image and the one after it.

    References
    ----------
    .. [1] J. von Neumann, "Distribution of the ratio of the mean square successive difference to
       the variance", Annals of Mathematical Statistics 12(4), 1941.
    """
    if len(pairs) < 2:
        return not pairs
    small = np.array([[_small(image) for image in pair] for pair in pairs])
    variance = small.reshape(-1, small[0, 0].size).var(axis=0, ddof=1).mean()
    successive = np.square(small[:, 1] - small[:, 0]).reshape(len(small), -1).mean(axis=1)
    ratio = np.quantile(successive, 0.25) / (2 * variance) if variance > _LEAST_CHANGE**2 else 0.0
    return bool(ratio > _UNRELATED)


def _small(image: NDArray[Any]) -> NDArray[np.float32]:
    """Reduce an image to shares of full scale, without its mean light."""
    small = cv2.resize(image, _SIZE_PX, interpolation=cv2.INTER_AREA)
    small = small.astype(np.float32) / np.float32(np.iinfo(image.dtype).max)
    return np.asarray(small - np.median(small, axis=(0, 1)), np.float32)
