"""In-plane displacement of the gel surface, drawn as arrows over a picture."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray


class ARROWS:
    """Style of the arrows. It has no effect on measurements, so nothing sets it from outside."""

    width_px = 960  # [px] Width of the result
    # [ratio] Brightness of the picture under the arrows, relative to the original.
    brightness = 0.75
    arrows_across = 28  # [count] Arrows along the width
    # [ratio] Length of the longest arrow relative to the spacing of the arrows.
    longest_spacings = 1.6
    shortest_px = 1.5  # [px] Shorter arrows are left out
    # [grey levels] R, G, B of arrows in the stick region, of arrows in the slip region, and of
    # the contour of either.
    stick_rgb = (255, 220, 60)
    slip_rgb = (255, 70, 40)
    edge_rgb = (30, 30, 30)
    # [px] Line width of an arrow, without and with its contour.
    line_px = 2
    edge_px = 4
    tip = 0.3  # [ratio] Length of the arrowhead relative to the arrow


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
