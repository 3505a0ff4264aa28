"""Sheets: a picture with a title line above, a scale bar below and a colour bar on the right."""

from __future__ import annotations

import cv2

from tactile_core.views.shading import (
    FAINT,
    INK,
    Rgb,
    blank,
    round_length,
    text_size,
    tick_label,
    ticks,
    write,
)


class SHEET:
    """Layout of sheets. It has no effect on measurements, so nothing sets it from outside.

    Lengths in sheet px are px on the smallest sheet and grow with the picture.
    """

    min_side_px = 640  # [px] Longer side of the smallest picture; smaller images are enlarged
    # [sheet px] Space on the left, above and below the picture.
    margin = 22
    header = 46
    footer = 46
    gap = 18  # [sheet px] Space between pictures and next to the colour bar
    # [sheet px] Width of the colour bar and of its labels.
    bar = 16
    labels = 72


def unit_of(picture: Rgb) -> float:
    """Return the scale of text and lines: 1 on the smallest sheet, proportional to the picture."""
    return int(max(picture.shape[:2])) / SHEET.min_side_px


def frame_picture(
    picture: Rgb,
    *,
    mm_per_px: float,
    bar: Rgb,
    span: tuple[float, float],
    unit: str = "mm",
    title: str,
    facts: str,
) -> Rgb:
    """Put a picture on a sheet with a title line, a scale bar and a colour bar.

    Parameters
    ----------
    picture : (H, W, 3) uint8
        Its longer side is at least 640 px.
    mm_per_px : float
        Size of a pixel of the picture on the gel.
    bar : (H, 3) uint8
        Colours from the lowest to the highest value.
    span : (lowest, highest)
        Values of the first and the last colour.
    unit : str
        Unit of these values.
    title, facts : str
        Text above the picture, on the left and on the right.

    Returns
    -------
    (H', W', 3) uint8
        R, G, B.
    """
    h, w = picture.shape[:2]
    size = unit_of(picture)
    lengths = (SHEET.margin, SHEET.header, SHEET.footer, SHEET.gap, SHEET.bar, SHEET.labels)
    margin, header, footer, gap, bar_width, labels = (round(part * size) for part in lengths)
    sheet = blank(header + h + footer, margin + w + gap + bar_width + labels)
    sheet[header : header + h, margin : margin + w] = picture
    _title(sheet, (margin, header), size, title, facts, w)
    _scale_bar(sheet, (margin, header + h), size, mm_per_px, w)
    left = margin + w + gap
    sheet[header : header + h, left : left + bar_width] = bar[::-1, None]
    _bar_labels(sheet, (left + bar_width, header, h), size, span, unit)
    return sheet


def _title(
    sheet: Rgb, left_top: tuple[int, int], unit: float, title: str, facts: str, width: int
) -> None:
    left, top = left_top
    base = top - 16 * unit
    facts_width = text_size(facts, unit)[0]
    if title:
        room = max(width - facts_width - 20 * unit, 0)
        while text_size(title, unit)[0] > room and len(title) > 4:
            title = title[:-4] + "..."
        write(sheet, title, (left, base), unit)
    write(sheet, facts, (left + width - facts_width if title else left, base), unit, FAINT)


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
    values = ticks(low, high)
    step = values[1] - values[0] if len(values) > 1 else high - low
    line = max(1, round(size))
    for value in values:
        y = round(top + (length - 1) * (high - value) / (high - low))
        cv2.line(sheet, (left, y), (round(left + 5 * size), y), FAINT, line)
        write(sheet, tick_label(value, step), (left + 10 * size, y + 5 * size), size)
    write(sheet, unit, (left + 10 * size, top - 16 * size), size, FAINT)
