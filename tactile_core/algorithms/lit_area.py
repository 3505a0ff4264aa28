"""Which part of a picture shows the lit skin, where a frame or a housing stands around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Box = tuple[int, int, int, int]

DARK_SHARE = 0.2
"""Of the brightness that a tenth of the picture exceeds: less is no lit skin."""

_WORKING_PX = 256
_LIT_EDGE = 0.9
_LEAST_CUT = 0.02
_LEAST_LEFT = 0.1


@dataclass(frozen=True)
class LitArea:
    """An upright rectangle of lit skin.

    Attributes
    ----------
    box : (x, y, width, height)
    taper : float
        The narrower end of the whole lit skin over its wider one, across or along: 1 seen straight
        on, less where the camera looks from aside.
    """

    box: Box
    taper: float


def lit_area(pixels: NDArray[Any]) -> LitArea | None:
    """Find the upright rectangle of lit skin, if dark surroundings leave anything to cut off.

    The largest connected lit area counts; its rectangle shrinks until nine tenths of each side are
    lit. A gel seen at an angle is no upright rectangle, and its corners are cut off.

    Parameters
    ----------
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        The untouched sensor.

    Returns
    -------
    LitArea or None
        None where all is lit, or so little that it cannot be skin.
    """
    from skimage.measure import label, regionprops  # late: it costs more than all else here

    height, width = pixels.shape[:2]
    shrink = max(1.0, max(height, width) / _WORKING_PX)
    size = max(1, round(width / shrink)), max(1, round(height / shrink))
    brightness = pixels if pixels.ndim == 2 else pixels.max(axis=2)
    small = cv2.resize(brightness.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small = cv2.morphologyEx(
        cv2.GaussianBlur(small, (0, 0), 1.0), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8)
    )
    lit = small > DARK_SHARE * np.percentile(small, 90)
    labels = label(lit, connectivity=2)
    regions = regionprops(labels)
    if not regions:
        return None
    largest = max(regions, key=lambda region: region.area)
    surface = labels == largest.label
    left, top, right, bottom = _shrunk(surface, largest.bbox)
    cut = max(left, top, size[0] - right, size[1] - bottom)
    share = (right - left) * (bottom - top) / (size[0] * size[1])
    if cut < _LEAST_CUT * max(size) or share < _LEAST_LEFT:
        return None
    x0, x1 = (round(v * width / size[0]) for v in (left, right))
    y0, y1 = (round(v * height / size[1]) for v in (top, bottom))
    return LitArea((x0, y0, x1 - x0, y1 - y0), min(_taper(surface), _taper(surface.T)))


def _taper(surface: NDArray[np.bool_]) -> float:
    """Width of the first third of the rows against the last, the narrower over the wider."""
    widths = surface.sum(axis=1)[surface.any(axis=1)]
    third = max(1, len(widths) // 3)
    ends = float(np.median(widths[:third])), float(np.median(widths[-third:]))
    return min(ends) / max(ends)


def _shrunk(lit: NDArray[np.bool_], bounds: tuple[int, int, int, int]) -> Box:
    """Left, top, right and bottom, the darkest side drawn in until all of them are lit."""
    top, left, bottom, right = bounds
    while right - left > 2 and bottom - top > 2:
        sides = {
            "left": lit[top:bottom, left].mean(),
            "right": lit[top:bottom, right - 1].mean(),
            "top": lit[top, left:right].mean(),
            "bottom": lit[bottom - 1, left:right].mean(),
        }
        darkest = min(sides, key=lambda side: sides[side])
        if sides[darkest] >= _LIT_EDGE:
            break
        left += darkest == "left"
        right -= darkest == "right"
        top += darkest == "top"
        bottom -= darkest == "bottom"
    return left, top, right, bottom
