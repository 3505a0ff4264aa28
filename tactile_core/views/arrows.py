"""How the skin is dragged, as arrows over a picture."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ACROSS = 28
_STICKS, _SLIPS, _EDGE = (255, 220, 60), (255, 70, 40), (30, 30, 30)
_LONGEST_SPACINGS = 1.6
_SHORTEST_PX = 1.5
_DIMMED = 0.75
_WIDTH_PX = 960


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
    (H', W', 3) uint8
        960 px wide.
    """
    height, width = pixels.shape[:2]
    larger = _WIDTH_PX / width
    size = (_WIDTH_PX, round(height * larger))
    shown = cv2.resize(pixels, size, interpolation=cv2.INTER_CUBIC) * np.float32(_DIMMED)
    picture = np.ascontiguousarray(shown.astype(np.uint8))
    step = max(1, width // _ACROSS)
    longest = float(np.linalg.norm(displacement_mm, axis=2).max())
    scale = _LONGEST_SPACINGS * step * larger / longest if longest > 0 else 0.0
    for y in range(step // 2, height, step):
        for x in range(step // 2, width, step):
            along, down = scale * displacement_mm[y, x]
            if np.hypot(along, down) < _SHORTEST_PX:
                continue
            colour = _SLIPS if slips is not None and slips[y, x] else _STICKS
            start = round(larger * x), round(larger * y)
            end = round(larger * x + along), round(larger * y + down)
            cv2.arrowedLine(picture, start, end, _EDGE, 4, cv2.LINE_AA, tipLength=0.3)
            cv2.arrowedLine(picture, start, end, colour, 2, cv2.LINE_AA, tipLength=0.3)
    return picture
