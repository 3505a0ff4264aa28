"""Pictures of a frame's measurements, side by side on one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tactile_core.quantities import Frame
from tactile_core.quantities.fields import (
    Layer,
    Outline,
    Points,
    ScalarMap,
    Surface,
    VectorMap,
)
from tactile_core.views.maps import Overlay, colour_field, join_texts, magnitude, relief
from tactile_core.views.shading import FOOTER, GAP, MIN_SIDE_PX, Rgb, blank, text_size, write


def picture_of(frame: Frame, layers: Sequence[Layer], *, title: str = "") -> Rgb | None:
    """Draw the layers of a frame's quantities side by side.

    Parameters
    ----------
    frame : Frame
        Background of points if there are no maps.
    layers : sequence of Layer
        From the quantities' ``layers()``.
    title : str
        Begins the line above the picture, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8 or None
        R, G, B; None if there is nothing to draw.
    """
    fields = [layer for layer in layers if isinstance(layer, VectorMap)]
    over = Overlay(
        [layer for layer in layers if isinstance(layer, Outline)],
        [layer for layer in layers if isinstance(layer, Points)],
        fields[0] if fields else None,
    )
    sheets: list[tuple[str, Rgb]] = []
    for layer in layers:
        line = "" if sheets else title
        if isinstance(layer, Surface):
            sheets.append((layer.title, relief(layer, over, title=line)))
        elif isinstance(layer, VectorMap):
            sheets.append((layer.title, magnitude(layer, over, frame.mm_per_px, title=line)))
        elif isinstance(layer, ScalarMap):
            sheets.append((layer.title, colour_field(layer, over, frame.mm_per_px, title=line)))
    if len(sheets) > 1:
        return side_by_side([sheet for _, sheet in sheets], [name for name, _ in sheets])
    if not sheets and over.points:
        return draw_on_frame(frame, Overlay(points=over.points), title=title)
    return sheets[0][1] if sheets else None


def draw_on_frame(frame: Frame, over: Overlay, *, title: str = "") -> Rgb:
    """Draw outlines, points and arrows over their frame.

    Parameters
    ----------
    frame : Frame
        With any number of channels.
    over : Overlay
        Unreliable points are hollow.
    title : str
        Begins the line below the picture, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    pixels = frame.pixels[..., :3] if frame.pixels.shape[2] >= 3 else frame.pixels[..., :1]
    levels = np.clip(pixels.astype(np.float32) * (255 / frame.full_scale), 0, 255)
    pale = np.broadcast_to(0.55 * levels + 57, (*levels.shape[:2], 3))  # half of its contrast
    height, width = levels.shape[:2]
    scale = max(1.0, MIN_SIDE_PX / max(height, width))
    large = round(width * scale), round(height * scale)
    picture = np.asarray(
        cv2.resize(pale.astype(np.uint8), large, interpolation=cv2.INTER_LINEAR), np.uint8
    )
    arrows = over.draw(picture, mm_per_px=frame.mm_per_px, scale=scale)
    counts = [
        f"{len(at.px) if at.reliable is None else int(at.reliable.sum())} of {len(at.px)} "
        f"{at.title} seen"
        for at in over.points
    ]
    return side_by_side([picture], [join_texts([title, *counts, arrows])])


def side_by_side(images: Sequence[Rgb], captions: Sequence[str]) -> Rgb:
    """Put pictures in a row, each with its caption below.

    Parameters
    ----------
    images : sequence of (H, W, 3) uint8
        R, G, B; scaled to the height of the tallest.
    captions : sequence of str
        One per image; can be empty.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    height = max(image.shape[0] for image in images)
    unit = max(1.0, height / MIN_SIDE_PX)
    gap, footer = round(GAP * unit), round(FOOTER * unit)
    fitted = [_of_height(image, height) for image in images]
    widths = [
        max(image.shape[1], text_size(caption, unit)[0])
        for image, caption in zip(fitted, captions, strict=True)
    ]
    sheet = blank(gap + height + footer, sum(widths) + gap * (len(widths) + 1))
    left = gap
    for image, caption, width in zip(fitted, captions, widths, strict=True):
        sheet[gap : gap + height, left : left + image.shape[1]] = image
        write(sheet, caption, (left, gap + height + 0.6 * footer), unit)
        left += width + gap
    return sheet


def _of_height(image: Rgb, height_px: int) -> Rgb:
    h, w = image.shape[:2]
    if h == height_px:
        return image
    size = (max(1, round(w * height_px / h)), height_px)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), np.uint8)
