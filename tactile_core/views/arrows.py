"""In-plane displacement of the gel surface, drawn as arrows over a picture."""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray


class ArrowParameters(NamedTuple):
    """Style of the arrows. It has no effect on measurements, so nothing sets it from outside.

    Attributes
    ----------
    width_px : int, px
        Width of the result. Source: chosen by hand.
    brightness : float, ratio
        Brightness of the picture under the arrows, relative to the original. Source: chosen by
        hand.
    arrows_across : int, count
        Arrows along the width. Source: chosen by hand.
    longest_spacings : float, ratio
        Length of the longest arrow relative to the spacing of the arrows. Source: chosen by hand.
    shortest_px : float, px
        Shorter arrows are left out. Source: chosen by hand.
    stick_rgb, slip_rgb, edge_rgb : tuple of int, grey levels
        R, G, B of arrows in the stick region, of arrows in the slip region, and of the contour of
        either. Source: chosen by hand.
    line_px, edge_px : int, px
        Line width of an arrow, without and with its contour. Source: chosen by hand.
    tip : float, ratio
        Length of the arrowhead relative to the arrow. Source: chosen by hand.
    """

    width_px: int = 960
    brightness: float = 0.75
    arrows_across: int = 28
    longest_spacings: float = 1.6
    shortest_px: float = 1.5
    stick_rgb: tuple[int, int, int] = (255, 220, 60)
    slip_rgb: tuple[int, int, int] = (255, 70, 40)
    edge_rgb: tuple[int, int, int] = (30, 30, 30)
    line_px: int = 2
    edge_px: int = 4
    tip: float = 0.3


ARROWS = ArrowParameters()
"""The values in use."""


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
        +x right, +y down. The longest arrow is a little longer than the spacing of the arrows.
    slips : (H, W) bool, optional
        Slip region, where the gel surface slides along the object; its arrows are red.

    Returns
    -------
    (H', W', 3) uint8
        960 px wide.
    """
    height, width = pixels.shape[:2]
    zoom = ARROWS.width_px / width
    size = (ARROWS.width_px, round(height * zoom))
    enlarged = cv2.resize(pixels, size, interpolation=cv2.INTER_CUBIC)
    dimmed = enlarged * np.float32(ARROWS.brightness)
    picture = np.ascontiguousarray(dimmed.astype(np.uint8))
    step = max(1, width // ARROWS.arrows_across)
    longest = float(np.linalg.norm(displacement_mm, axis=2).max())
    scale = ARROWS.longest_spacings * step * zoom / longest if longest > 0 else 0.0
    for y in range(step // 2, height, step):
        for x in range(step // 2, width, step):
            right, down = scale * displacement_mm[y, x]
            if np.hypot(right, down) < ARROWS.shortest_px:
                continue
            colour = ARROWS.slip_rgb if slips is not None and slips[y, x] else ARROWS.stick_rgb
            start = round(zoom * x), round(zoom * y)
            end = round(zoom * x + right), round(zoom * y + down)
            for rgb, line in ((ARROWS.edge_rgb, ARROWS.edge_px), (colour, ARROWS.line_px)):
                cv2.arrowedLine(picture, start, end, rgb, line, cv2.LINE_AA, tipLength=ARROWS.tip)
    return picture
