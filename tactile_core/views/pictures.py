"""Pictures of what was measured, side by side on one sheet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from tactile_core.quantities import Frame
from tactile_core.quantities.layers import (
    Layer,
    Outline,
    Points,
    ScalarMap,
    Surface,
    VectorMap,
)
from tactile_core.views.drawing import Rgb, blank, text_size, write
from tactile_core.views.maps import Over, coloured, listed, magnitude, relief
from tactile_core.views.sheet import FOOT, GAP, SMALLEST_PX

_DIMMED = 0.55


def picture_of(frame: Frame, layers: Sequence[Layer], *, title: str = "") -> Rgb | None:
    """Draw what a frame's quantities have to show, side by side.

    Parameters
    ----------
    frame : Frame
        Shown beneath points where nothing else is drawn.
    layers : sequence of Layer
        What the quantities' ``layers()`` gave.
    title : str
        Begins the line above the picture, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8 or None
        R, G, B; None where there is nothing to show.
    """
    fields = [layer for layer in layers if isinstance(layer, VectorMap)]
    over = Over(
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
            sheets.append((layer.title, coloured(layer, over, frame.mm_per_px, title=line)))
    if len(sheets) > 1:
        return side_by_side([sheet for _, sheet in sheets], [name for name, _ in sheets])
    if not sheets and over.points:
        return marked(frame, over.points, title=title)
    return sheets[0][1] if sheets else None


def marked(frame: Frame, points: Sequence[Points], *, title: str = "") -> Rgb:
    """Draw points, and where they went, over the frame that shows them.

    Parameters
    ----------
    frame : Frame
        Of any number of channels.
    points : sequence of Points
        Those that are not sure are hollow.
    title : str
        Written beneath, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    seen = frame.pixels[..., :3] if frame.pixels.shape[2] >= 3 else frame.pixels[..., :1]
    light = np.clip(seen.astype(np.float32) * (255 / frame.full_scale), 0, 255)
    shown = np.broadcast_to(_DIMMED * light, (*light.shape[:2], 3)) + 255 * (1 - _DIMMED) / 2
    height, width = light.shape[:2]
    scale = max(1.0, SMALLEST_PX / max(height, width))
    large = round(width * scale), round(height * scale)
    picture = np.asarray(
        cv2.resize(shown.astype(np.uint8), large, interpolation=cv2.INTER_LINEAR), np.uint8
    )
    arrows = Over(points=points).draw(picture, mm_per_px=frame.mm_per_px, scale=scale)
    counts = [
        f"{len(at.px) if at.reliable is None else int(at.reliable.sum())} of {len(at.px)} "
        f"{at.title} seen"
        for at in points
    ]
    return side_by_side([picture], [listed([title, *counts, arrows])])


def side_by_side(images: Sequence[Rgb], captions: Sequence[str]) -> Rgb:
    """Put pictures in a row, each with its caption beneath.

    Parameters
    ----------
    images : sequence of (H, W, 3) uint8
        R, G, B; made equally high, that of the highest.
    captions : sequence of str
        As many; may be empty strings.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    high = max(image.shape[0] for image in images)
    unit = max(1.0, high / SMALLEST_PX)
    gap, foot = round(GAP * unit), round(FOOT * unit)
    fitted = [_of_height(image, high) for image in images]
    wide = [
        max(image.shape[1], text_size(caption, unit)[0])
        for image, caption in zip(fitted, captions, strict=True)
    ]
    sheet = blank(gap + high + foot, sum(wide) + gap * (len(wide) + 1))
    left = gap
    for image, caption, width in zip(fitted, captions, wide, strict=True):
        sheet[gap : gap + high, left : left + image.shape[1]] = image
        write(sheet, caption, (left, gap + high + 0.6 * foot), unit)
        left += width + gap
    return sheet


def _of_height(image: Rgb, height_px: int) -> Rgb:
    h, w = image.shape[:2]
    if h == height_px:
        return image
    size = (max(1, round(w * height_px / h)), height_px)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), np.uint8)
