"""Text and tick labels on a picture, in sizes proportional to it."""

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
