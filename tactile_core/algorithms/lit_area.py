"""Part of an image that shows the illuminated gel surface, inside a dark frame or housing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Box = tuple[int, int, int, int]


class LIT_AREA:
    """Parameters of the search for the illuminated area.

    Nothing sets them from outside: the result is a proposal that the user may edit in the profile.
    """

    working_px = 256  # [px] The longer side of the image is reduced to this
    blur_px = 1.0  # [px] Standard deviation of the smoothing of the reduced image
    closing_px = 9  # [px] Side of the closing that bridges markers and dust
    bright_percentile: float = 90  # [percent] Percentile of the brightness that counts as bright
    dark_share = 0.2  # [share of the bright level] Pixels up to this are not illuminated
    # [share of a side] The rectangle shrinks until this much of each side is illuminated.
    edge_share = 0.9
    # [share of the longer side] If less than this is to be cropped on every side, nothing is.
    least_crop_share = 0.02
    least_area_share = 0.1  # [share of the image] A smaller rectangle is not the gel surface


@dataclass(frozen=True)
class LitArea:
    """Upright rectangle of illuminated gel surface.

    Attributes
    ----------
    box : (x, y, width, height)
        In px.
    taper : float
        Width of the narrower end of the illuminated area over that of the wider one, along x or y:
        1 seen straight on, less seen at an angle.
    """

    box: Box
    taper: float


def lit_area(pixels: NDArray[Any]) -> LitArea | None:
    """Find the upright rectangle of illuminated gel surface in front of dark surroundings.

    The bounding box of the largest connected bright region shrinks until nine tenths of each side
    are illuminated. A gel seen at an angle is not an upright rectangle; its corners are cropped.

    Parameters
    ----------
    pixels : (H, W) or (H, W, 3) uint8 or uint16
        Image of the undeformed sensor.

    Returns
    -------
    LitArea or None
        None where nothing is to be cropped, or the bright area is too small for a gel surface.
    """
    from skimage.measure import label, regionprops  # late: the import takes longer than the rest

    height, width = pixels.shape[:2]
    shrink = max(1.0, max(height, width) / LIT_AREA.working_px)
    size = max(1, round(width / shrink)), max(1, round(height / shrink))
    brightness = pixels if pixels.ndim == 2 else pixels.max(axis=2)
    small = cv2.resize(brightness.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    small = cv2.morphologyEx(
        cv2.GaussianBlur(small, (0, 0), LIT_AREA.blur_px),
        cv2.MORPH_CLOSE,
        np.ones((LIT_AREA.closing_px,) * 2, np.uint8),
    )
    lit = small > LIT_AREA.dark_share * np.percentile(small, LIT_AREA.bright_percentile)
    labels = label(lit, connectivity=2)
    regions = regionprops(labels)
    if not regions:
        return None
    largest = max(regions, key=lambda region: region.area)
    surface = labels == largest.label
    left, top, right, bottom = _shrunk(surface, largest.bbox)
    crop = max(left, top, size[0] - right, size[1] - bottom)
    share = (right - left) * (bottom - top) / (size[0] * size[1])
    if crop < LIT_AREA.least_crop_share * max(size) or share < LIT_AREA.least_area_share:
        return None
    x0, x1 = (round(v * width / size[0]) for v in (left, right))
    y0, y1 = (round(v * height / size[1]) for v in (top, bottom))
    return LitArea((x0, y0, x1 - x0, y1 - y0), min(_taper(surface), _taper(surface.T)))


def _taper(surface: NDArray[np.bool_]) -> float:
    """Median width of the first and the last third of the rows, the narrower over the wider."""
    widths = surface.sum(axis=1)[surface.any(axis=1)]
    third = max(1, len(widths) // 3)
    ends = float(np.median(widths[:third])), float(np.median(widths[-third:]))
    return min(ends) / max(ends)


def _shrunk(lit: NDArray[np.bool_], bounds: tuple[int, int, int, int]) -> Box:
    """Left, top, right and bottom after moving in the darkest side until all are illuminated."""
    top, left, bottom, right = bounds
    while right - left > 2 and bottom - top > 2:
        sides = {
            "left": lit[top:bottom, left].mean(),
            "right": lit[top:bottom, right - 1].mean(),
            "top": lit[top, left:right].mean(),
            "bottom": lit[bottom - 1, left:right].mean(),
        }
        darkest = min(sides, key=lambda side: sides[side])
        if sides[darkest] >= LIT_AREA.edge_share:
            break
        left += darkest == "left"
        right -= darkest == "right"
        top += darkest == "top"
        bottom -= darkest == "bottom"
    return left, top, right, bottom
