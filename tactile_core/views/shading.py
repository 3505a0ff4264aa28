"""Shaded heights, lines and text, on a sheet with a title and a bar."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

Rgb = NDArray[np.uint8]
Colour = tuple[int, int, int]

PAPER: Colour = (252, 252, 250)  # R, G, B of the background of a sheet

INK: Colour = (38, 46, 54)  # R, G, B of text and of the scale bar

FAINT: Colour = (120, 128, 136)  # R, G, B of secondary text and of ticks

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_TEXT_SCALE = 0.5  # Size of text relative to OpenCV's font, on the smallest sheet

# Replacements for characters that OpenCV's stroke font lacks.
_ASCII = str.maketrans({"²": "^2", "×": "x", "−": "-", "°": "deg", "µ": "u"})


def blank(height_px: int, width_px: int) -> Rgb:
    """Return an empty sheet."""
    return np.full((height_px, width_px, 3), PAPER, np.uint8)


def text_size(words: str, unit: float) -> tuple[int, int]:
    """Return the width and height of a text, px; ``unit`` is 1 on the smallest sheet."""
    (width, height), _ = cv2.getTextSize(_drawable(words), _FONT, _TEXT_SCALE * unit, _line(unit))
    return int(width), int(height)


def write(
    sheet: Rgb, words: str, left_base_px: tuple[float, float], unit: float, colour: Colour = INK
) -> None:
    """Write a text on a sheet; its baseline begins at ``left_base_px``."""
    place = (round(left_base_px[0]), round(left_base_px[1]))
    size, line = _TEXT_SCALE * unit, _line(unit)
    cv2.putText(sheet, _drawable(words), place, _FONT, size, colour, line, cv2.LINE_AA)


def round_length(limit: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten up to ``limit``."""
    power = 10.0 ** math.floor(math.log10(limit) + 1e-9)
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= limit * (1 + 1e-9))


def ticks(low: float, high: float, count: int = 6) -> list[float]:
    """Return round numbers from ``low`` to ``high``, about ``count`` of them or fewer."""
    step = round_length((high - low) / count * 2.5)
    first = math.ceil(low / step - 1e-6)
    return [i * step for i in range(first, math.floor(high / step + 1e-6) + 1)]


def tick_label(value: float, step: float) -> str:
    """Return a number with as many decimals as the distance of the ticks needs."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value + 0.0:.{decimals}f}".replace("-", "−")


def _drawable(words: str) -> str:
    # OpenCV aborts the process on text that is not UTF-8, as file names can be
    words = words.encode("utf-8", "replace").decode("utf-8")
    return words if _true_type() else words.translate(_ASCII)


def _line(unit: float) -> int:
    # the line width of a stroke font must scale with its size; for TrueType it means boldness
    return 1 if _true_type() else max(1, round(unit))


def _true_type() -> bool:
    """Whether OpenCV draws TrueType letters: version 5 does, earlier ones draw ASCII strokes."""
    return int(cv2.__version__.split(".")[0]) >= 5


def shade_heights(
    height_mm: NDArray[np.float32], mm_per_px: float, low_mm: float, high_mm: float
) -> Rgb:
    """Colour a height map by its height and shade it by its slope, with light from the upper left.

    The shading exaggerates faint relief, up to six times.

    Parameters
    ----------
    height_mm : (H, W) float32
        Larger is nearer to the viewer.
    mm_per_px : float
        Size of a pixel.
    low_mm, high_mm : float
        Heights of the first and the last colour.

    Returns
    -------
    (H, W, 3) uint8
        R, G, B.
    """
    row, column = np.gradient(height_mm, mm_per_px) if min(height_mm.shape) > 1 else (0.0, 0.0)
    light = np.array([-0.45, -0.55, 0.7]) / np.linalg.norm([-0.45, -0.55, 0.7])
    slope = np.hypot(row, column)
    steep = float(np.percentile(slope[::3, ::3], 99)) if np.ndim(slope) else 0.0
    factor = np.clip(0.7 / max(steep, 1e-9), 1.0, 6.0)  # to slopes of 0.7, which show clearly
    facing = light[2] - factor * (light[0] * column + light[1] * row)
    shade = facing / np.sqrt(1 + (factor * slope) ** 2) - light[2]
    flat = sequential_colours((height_mm - np.float32(low_mm)) / np.float32(high_mm - low_mm))
    brightness = np.float32(1) + np.asarray(shade, np.float32)[..., None]
    return np.clip(flat * brightness, 0, 255).astype(np.uint8)


def colours(count: int) -> Rgb:
    """Return (count, 3) uint8 unshaded colours from the lowest to the highest height."""
    return sequential_colours(np.linspace(0, 1, count, dtype=np.float32))


def sequential_colours(level: NDArray[np.float32]) -> Rgb:
    """Map numbers from 0 to 1 to the unshaded colours of heights.

    Parameters
    ----------
    level : (…) float32
        Clipped to 0 … 1.

    Returns
    -------
    (…, 3) uint8
        R, G, B; equal steps look equally large, also to the colour-blind.
    """
    # the darkest fifth of viridis would hide the shading
    index = np.rint(56 + 199 * np.clip(level, 0, 1)).astype(np.uint8)
    table = cv2.applyColorMap(np.arange(256, dtype=np.uint8), cv2.COLORMAP_VIRIDIS)
    return np.asarray(table.reshape(256, 3)[index, ::-1])


def diverging_colours(level: NDArray[np.float32]) -> Rgb:
    """Map numbers from −1 to 1 to colours from blue through white to red.

    Parameters
    ----------
    level : (…) float32
        Clipped to −1 … 1.

    Returns
    -------
    (…, 3) uint8
        R, G, B.
    """
    ends = ((33, 248, 178), (102, 248, 24), (172, 248, 43))  # R, G and B of −1, 0 and 1
    return np.stack([np.interp(level, (-1, 0, 1), end) for end in ends], -1).astype(np.uint8)


MIN_SIDE_PX = 640  # Longer side of the smallest picture; smaller images are enlarged
HEADER, FOOTER, GAP = 46, 46, 18  # Above, below and between pictures, px on the smallest sheet


def unit_of(picture: Rgb) -> float:
    """Return the scale of text and lines: 1 on the smallest sheet, proportional to the picture."""
    return int(max(picture.shape[:2])) / MIN_SIDE_PX


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
    lengths = (22, HEADER, FOOTER, GAP, 16, 72)  # the last are colour bar and labels
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
