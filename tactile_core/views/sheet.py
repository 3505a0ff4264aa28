"""What frames a picture of the skin: a line above it, a scale bar beneath, a colour bar beside."""

from __future__ import annotations

import cv2

from tactile_core.views.drawing import (
    FAINT,
    INK,
    Rgb,
    blank,
    in_words,
    round_length,
    text_size,
    ticks,
    write,
)

SMALLEST_PX = 640
FOOT, GAP = 46, 18
_MARGIN, _TITLE, _BAR, _LABELS = 22, 46, 16, 72


def unit_of(picture: Rgb) -> float:
    """How much larger than on the smallest sheet words and lines are drawn."""
    return int(max(picture.shape[:2])) / SMALLEST_PX


def framed(
    picture: Rgb,
    *,
    mm_per_px: float,
    bar: Rgb,
    span: tuple[float, float],
    unit: str = "mm",
    title: str,
    facts: str,
) -> Rgb:
    """Put a picture on a sheet that says what its colours and lengths mean.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        Its larger side is at least 640 px.
    mm_per_px : float
        Size of one of its pixels on the gel.
    bar : (H, 3) uint8
        Colours from the lowest to the highest value.
    span : (lowest, highest)
        The values of the first and the last colour.
    unit : str
        Of these values.
    title, facts : str
        The line above the picture, left and right.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    h, w = picture.shape[:2]
    size = unit_of(picture)
    margin, head, foot, gap, wide, labels = (
        round(part * size) for part in (_MARGIN, _TITLE, FOOT, GAP, _BAR, _LABELS)
    )
    sheet = blank(head + h + foot, margin + w + gap + wide + labels)
    sheet[head : head + h, margin : margin + w] = picture
    _title(sheet, (margin, head), size, title, facts, w)
    _scale_bar(sheet, (margin, head + h), size, mm_per_px, w)
    left = margin + w + gap
    sheet[head : head + h, left : left + wide] = bar[::-1, None]
    _bar_labels(sheet, (left + wide, head, h), size, span, unit)
    return sheet


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
    sheet: Rgb, place: tuple[int, int, int], size: float, span: tuple[float, float], unit: str
) -> None:
    left, top, length = place
    low, high = span
    markers = ticks(low, high)
    step = markers[1] - markers[0] if len(markers) > 1 else high - low
    line = max(1, round(size))
    for value in markers:
        y = round(top + (length - 1) * (high - value) / (high - low))
        cv2.line(sheet, (left, y), (round(left + 5 * size), y), FAINT, line)
        write(sheet, in_words(value, step), (left + 10 * size, y + 5 * size), size)
    write(sheet, unit, (left + 10 * size, top - 16 * size), size, FAINT)
