"""Words, bars and rules on a picture, all in sizes that grow with it."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

Rgb = NDArray[np.uint8]
Colour = tuple[int, int, int]

PAPER: Colour = (252, 252, 250)
INK: Colour = (38, 46, 54)
FAINT: Colour = (120, 128, 136)

_FONT = cv2.FONT_HERSHEY_SIMPLEX
_TEXT_SCALE = 0.5
_PLAIN = str.maketrans({"²": "^2", "×": "x", "−": "-", "°": "deg", "µ": "u"})


def blank(height_px: int, width_px: int) -> Rgb:
    """Return an empty sheet."""
    return np.full((height_px, width_px, 3), PAPER, np.uint8)


def text_size(words: str, unit: float) -> tuple[int, int]:
    """Width and height of a text, px."""
    (width, height), _ = cv2.getTextSize(_drawable(words), _FONT, _TEXT_SCALE * unit, _line(unit))
    return int(width), int(height)


def write(
    sheet: Rgb, words: str, left_base_px: tuple[float, float], unit: float, colour: Colour = INK
) -> None:
    """Write a text whose first letter stands at this point."""
    place = (round(left_base_px[0]), round(left_base_px[1]))
    size, line = _TEXT_SCALE * unit, _line(unit)
    cv2.putText(sheet, _drawable(words), place, _FONT, size, colour, line, cv2.LINE_AA)


def round_length(most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above ``most``."""
    power = 10.0 ** math.floor(math.log10(most) + 1e-9)
    return next(step * power for step in (5.0, 2.0, 1.0) if step * power <= most * (1 + 1e-9))


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers from ``low`` to ``high``, at most about ``most``."""
    step = round_length((high - low) / most * 2.5)
    first = math.ceil(low / step - 1e-6)
    return [i * step for i in range(first, math.floor(high / step + 1e-6) + 1)]


def in_words(value: float, step: float) -> str:
    """Return a number with the decimals that its step needs."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return f"{value + 0.0:.{decimals}f}".replace("-", "−")


def _drawable(words: str) -> str:
    # OpenCV ends the process where a text is no UTF-8, as a file's name may be
    words = words.encode("utf-8", "replace").decode("utf-8")
    return words if _true_type() else words.translate(_PLAIN)


def _line(unit: float) -> int:
    # a stroke font's lines must grow with it; for a true font the same number means bold
    return 1 if _true_type() else max(1, round(unit))


def _true_type() -> bool:
    """OpenCV 5 draws real letters of all alphabets; before, it drew strokes and knew ASCII."""
    return int(cv2.__version__.split(".")[0]) >= 5
