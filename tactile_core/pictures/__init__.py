"""Pictures of measurements, made to be looked at."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.pictures.drawing import (
    FAINT,
    INK,
    blank,
    in_words,
    round_length,
    text_size,
    ticks,
    write,
)
from tactile_core.pictures.shading import colours, shaded
from tactile_core.quantities import ContactMask, HeightMap

Rgb = NDArray[np.uint8]

_SMALLEST_PX = 640
_MARGIN, _TITLE, _FOOT, _GAP, _BAR, _LABELS = 22, 46, 46, 18, 16, 72
_ENLARGED_BLUR_PX, _OUTLINE_BLUR_PX = 0.6, 1.0
_OUTLINE, _HALO = (255, 255, 255), (45, 52, 62)


def relief(height: HeightMap, contact: ContactMask | None, *, title: str = "") -> Rgb:
    """Draw a height map as shaded relief with a scale bar, a colour bar in mm and the contact.

    The larger side is at least 640 px, so that small sensors' words are legible too. Noise is not
    stretched over all colours: the bar spans at least the size of one pixel on the gel.

    Parameters
    ----------
    height : HeightMap
        Finite; all zero gives an even surface.
    contact : ContactMask or None
        Outlined where given.
    title : str
        Begins the line above the picture, e.g. the name of the observation.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    surface, scale = _enlarged(height)
    low = min(0.0, float(height.mm.min()))
    high = max(float(height.mm.max()), low + height.mm_per_px)
    picture = shaded(surface, height.mm_per_px / scale, low, high)
    h, w = picture.shape[:2]
    unit = max(h, w) / _SMALLEST_PX
    if contact is not None:
        _outline(picture, contact, unit)
    margin, head, foot, gap, bar, labels = (
        round(part * unit) for part in (_MARGIN, _TITLE, _FOOT, _GAP, _BAR, _LABELS)
    )
    sheet = blank(head + h + foot, margin + w + gap + bar + labels)
    sheet[head : head + h, margin : margin + w] = picture
    _title(sheet, (margin, head), unit, title, _facts(height, contact), w)
    _scale_bar(sheet, (margin, head + h), unit, height.mm_per_px / scale, w)
    left = margin + w + gap
    sheet[head : head + h, left : left + bar] = colours(h)[::-1, None]
    _bar_labels(sheet, left + bar, head, h, unit, low, high)
    return sheet


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
    unit = max(1.0, high / _SMALLEST_PX)
    gap, foot = round(_GAP * unit), round(_FOOT * unit)
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


def _enlarged(height: HeightMap) -> tuple[NDArray[np.float32], float]:
    h, w = height.mm.shape
    scale = max(1.0, _SMALLEST_PX / max(h, w))
    if scale == 1.0:
        return height.mm, scale
    size = (max(1, round(w * scale)), max(1, round(h * scale)))
    large = cv2.resize(height.mm, size, interpolation=cv2.INTER_CUBIC)
    # the slopes of an interpolated surface show the pixels' grid; half a pixel of blur hides it
    return np.asarray(cv2.GaussianBlur(large, (0, 0), _ENLARGED_BLUR_PX * scale)), scale


def _of_height(image: Rgb, height_px: int) -> Rgb:
    h, w = image.shape[:2]
    if h == height_px:
        return image
    size = (max(1, round(w * height_px / h)), height_px)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR), np.uint8)


def _outline(picture: Rgb, contact: ContactMask, unit: float) -> None:
    h, w = picture.shape[:2]
    smooth = cv2.resize(contact.mask.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR)
    scale = w / contact.mask.shape[1]
    if scale > 1:
        smooth = cv2.GaussianBlur(smooth, (0, 0), _OUTLINE_BLUR_PX * scale)
    curves, _ = cv2.findContours(
        (smooth > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    line = max(2, round(unit))
    for colour, width in ((_HALO, line + 2), (_OUTLINE, line)):
        cv2.drawContours(picture, curves, -1, colour, width, cv2.LINE_AA)


def _facts(height: HeightMap, contact: ContactMask | None) -> str:
    facts = [f"max {float(height.mm.max()):.3f} mm"]
    if contact is not None:
        facts.append(f"contact {contact.area_mm2:.2f} mm²")
    return ", ".join(facts)


def _title(
    sheet: Rgb, left_top: tuple[int, int], unit: float, title: str, facts: str, width: int
) -> None:
    left, top = left_top
    base = top - 16 * unit
    wide = text_size(facts, unit)[0]
    if title:
        while text_size(title, unit)[0] > max(width - wide - 20 * unit, 0) and len(title) > 4:
            title = title[:-4] + "..."
        write(sheet, title, (left, base), unit)
    write(sheet, facts, (left + width - wide if title else left, base), unit, FAINT)


def _scale_bar(
    sheet: Rgb, left_top: tuple[int, int], unit: float, mm_per_px: float, width: int
) -> None:
    left, top = left_top
    length_mm = round_length(0.25 * width * mm_per_px)
    length_px = round(length_mm / mm_per_px)
    thick = max(3, round(4 * unit))
    y = round(top + 20 * unit)
    cv2.rectangle(sheet, (left, y), (left + length_px, y + thick - 1), INK, -1)
    write(
        sheet, f"{length_mm:g} mm", (left + length_px + 10 * unit, y + thick / 2 + 5 * unit), unit
    )


def _bar_labels(
    sheet: Rgb, left: int, top: int, length: int, unit: float, low: float, high: float
) -> None:
    marks = ticks(low, high)
    step = marks[1] - marks[0] if len(marks) > 1 else high - low
    line = max(1, round(unit))
    for value in marks:
        y = round(top + (length - 1) * (high - value) / (high - low))
        cv2.line(sheet, (left, y), (round(left + 5 * unit), y), FAINT, line)
        write(sheet, in_words(value, step), (left + 10 * unit, y + 5 * unit), unit)
    write(sheet, "mm", (left + 10 * unit, top - 16 * unit), unit, FAINT)
