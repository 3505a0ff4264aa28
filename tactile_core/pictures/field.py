"""How the skin is dragged, as arrows over a picture."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ACROSS = 28
_STICKS, _SLIPS = (255, 220, 60), (255, 70, 40)
_LONGEST_SPACINGS = 1.6


def arrows(
    pixels: NDArray[np.uint8],
    displacement_mm: NDArray[Any],
    *,
    slips: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """Draw a displacement field over a picture.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
        RGB.
    displacement_mm : (H, W, 2)
        +x right, +y down. The longest arrow is drawn a little longer than their spacing.
    slips : (H, W) bool, optional
        Where the skin slides along the object; its arrows are red.

    Returns
    -------
    (2 H, 2 W, 3) uint8
    """
    height, width = pixels.shape[:2]
    shown = cv2.resize(pixels, (2 * width, 2 * height), interpolation=cv2.INTER_LINEAR) // 2
    picture = np.ascontiguousarray(shown)
    step = max(4, width // _ACROSS)
    longest = float(np.linalg.norm(displacement_mm, axis=2).max())
    scale = _LONGEST_SPACINGS * step / longest if longest > 0 else 0.0
    for y in range(step // 2, height, step):
        for x in range(step // 2, width, step):
            along, down = scale * displacement_mm[y, x]
            colour = _SLIPS if slips is not None and slips[y, x] else _STICKS
            start, end = (2 * x, 2 * y), (round(2 * (x + along)), round(2 * (y + down)))
            cv2.arrowedLine(picture, start, end, colour, 2, cv2.LINE_AA, tipLength=0.3)
    return np.asarray(picture, np.uint8)
