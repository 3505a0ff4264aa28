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


class SHADING:
    """Colours of maps. They have no effect on measurements, so nothing sets them from outside.

    Lightness is from 0 to 1. Lightness, chroma and hue are those of OKLab [1]_.

    References
    ----------
    .. [1] B. Ottosson, "A perceptual color space for image processing", 2020.
    """

    # [count] Heights and brightnesses that the table of colours distinguishes. Source: 8-bit
    # images have 256 levels; the number of shades is chosen by hand.
    levels = 256
    shades = 128
    # [ratio] Direction towards the light, x right, y down and z towards the viewer; normalised
    # before use. Source: maps are shaded from the upper left by convention; chosen by hand.
    light = (-0.45, -0.55, 0.7)
    shade_strength = 0.42  # [ratio] Largest change of lightness by shading
    shaded_lightness = (0.08, 0.99)  # [ratio] Limits of the lightness after shading
    max_exaggeration = 6.0  # [ratio] Limit of the factor by which shading exaggerates slopes
    # [ratio] Slope to which the 99th percentile of a map's slopes is exaggerated.
    clear_slope = 0.7
    # [ratio, ratio and degrees] Lightness, chroma and hue of the lowest height (slate) and of the
    # highest (ivory).
    low = (0.47, 0.060, 268.0)
    high = (0.93, 0.115, 90.0)
    middle_chroma = 0.012  # [ratio] Chroma that is added halfway between the two
    # [degrees] Hues of diverging colours: blue and red.
    negative_hue_deg = 255.0
    positive_hue_deg = 30.0
    # [ratio] Lightness of diverging colours at 0, and its decrease at ±1.
    white = 0.98
    dark = 0.45
    diverging_chroma = 0.17  # [ratio] Chroma of diverging colours at ±1


def shade_heights(
    height_mm: NDArray[np.float32], mm_per_px: float, low_mm: float, high_mm: float
) -> Rgb:
    """Colour a height map by its height and shade it by its slope.

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
    level = (height_mm - low_mm) * ((SHADING.levels - 1) / (high_mm - low_mm))
    row, column = np.gradient(height_mm, mm_per_px) if min(height_mm.shape) > 1 else (0.0, 0.0)
    light = np.array(SHADING.light) / np.linalg.norm(SHADING.light)
    slope = np.hypot(row, column)
    steep = float(np.percentile(slope[::3, ::3], 99)) if np.ndim(slope) else 0.0
    factor = np.clip(SHADING.clear_slope / max(steep, 1e-9), 1.0, SHADING.max_exaggeration)
    facing = light[2] - factor * (light[0] * column + light[1] * row)
    shade = facing / np.sqrt(1 + (factor * slope) ** 2) - light[2]
    table = _table()
    rows = np.clip(level, 0, SHADING.levels - 1).astype(np.intp)
    columns = np.clip((shade + 1) * (SHADING.shades / 2), 0, SHADING.shades - 1).astype(np.intp)
    return np.asarray(table[rows, columns])


def colours(count: int) -> Rgb:
    """Return (count, 3) uint8 unshaded colours from the lowest to the highest height."""
    return _to_srgb(*_path(np.linspace(0, 1, count)))


def sequential_colours(level: NDArray[np.float32]) -> Rgb:
    """Map numbers from 0 to 1 to the unshaded colours of heights.

    Parameters
    ----------
    level : (…) float32
        Clipped to 0 … 1.

    Returns
    -------
    (…, 3) uint8
        R, G, B.
    """
    table = colours(SHADING.levels)
    return np.asarray(table[np.rint(np.clip(level, 0, 1) * (SHADING.levels - 1)).astype(np.intp)])


def diverging_colours(level: NDArray[np.float32]) -> Rgb:
    """Map numbers from −1 to 1 to colours from blue through white to red.

    Parameters
    ----------
    level : (…) float32
        Clipped to −1 … 1.

    Returns
    -------
    (…, 3) uint8
        R, G, B; equal steps look equally large on both sides.
    """
    t = np.linspace(-1, 1, 2 * SHADING.levels + 1)
    hue = np.radians(np.where(t < 0, SHADING.negative_hue_deg, SHADING.positive_hue_deg))
    lightness = SHADING.white - SHADING.dark * np.abs(t)
    chroma = SHADING.diverging_chroma * np.abs(t)
    table = _to_srgb(lightness, chroma * np.cos(hue), chroma * np.sin(hue))
    return np.asarray(table[np.rint((np.clip(level, -1, 1) + 1) * SHADING.levels).astype(np.intp)])


def _table() -> Rgb:
    """Return (levels, shades, 3) colours: for each height from the darkest to the brightest."""
    lightness, a, b = (part[:, None] for part in _path(np.linspace(0, 1, SHADING.levels)))
    shade = np.linspace(-1, 1, SHADING.shades, endpoint=False) * SHADING.shade_strength
    shaded_lightness = np.clip(lightness + shade, *SHADING.shaded_lightness)
    # chroma decreases with lightness, so that a darker colour looks equally saturated
    keep = np.minimum(shaded_lightness / lightness, 1.0)
    return _to_srgb(shaded_lightness, a * keep, b * keep)


def _path(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """OKLab coordinates along the colour bar; lightness increases linearly."""
    low, high = SHADING.low, SHADING.high
    lightness = low[0] + (high[0] - low[0]) * t
    chroma = low[1] + (high[1] - low[1]) * t + 4 * t * (1 - t) * SHADING.middle_chroma
    hue = np.radians(low[2] + (high[2] - low[2]) * t)
    return lightness, chroma * np.cos(hue), chroma * np.sin(hue)


def _to_srgb(lightness: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> Rgb:
    """Convert OKLab to 8-bit sRGB."""
    long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
    medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
    short = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
    linear = np.stack(
        [
            4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
            -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
            -0.0041960863 * long - 0.7034186147 * medium + 1.7076147010 * short,
        ],
        axis=-1,
    )
    linear = np.clip(linear, 0, 1)
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * coded), np.uint8)


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
