"""From heights to shaded colours, in a colour space where equal steps look equal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.views.drawing import Rgb

_LEVELS, _SHADES = 256, 128
_LIGHT = np.array([-0.45, -0.55, 0.7])
"""Direction towards the lamp: from the upper left, as readers of maps expect."""

_SHADE_STRENGTH = 0.42
_STEEPEST_EXAGGERATION = 6.0
_CLEAR_SLOPE = 0.7
"""Slope, after exaggeration, of the steep parts of a map."""

# lightness, chroma and hue (degrees) of the lowest and the highest point: slate to warm ivory
_LOW, _HIGH = (0.47, 0.060, 268.0), (0.93, 0.115, 90.0)
_MIDDLE_CHROMA = 0.012
_COLD_DEG, _WARM_DEG = 255.0, 30.0
"""Hues of negative and positive deviations."""


def shaded(height_mm: NDArray[np.float32], mm_per_px: float, low_mm: float, high_mm: float) -> Rgb:
    """Colour a height map by its height and shade it by its slope.

    Faint relief is exaggerated, up to eight times, for the shading alone.

    Parameters
    ----------
    height_mm : (H, W) float32
        Larger is nearer to the viewer.
    mm_per_px : float
        Size of a pixel.
    low_mm, high_mm : float
        Heights that get the first and the last colour.

    Returns
    -------
    (H, W, 3) uint8
        R, G, B.
    """
    level = (height_mm - low_mm) * ((_LEVELS - 1) / (high_mm - low_mm))
    row, column = np.gradient(height_mm, mm_per_px) if min(height_mm.shape) > 1 else (0.0, 0.0)
    light = _LIGHT / np.linalg.norm(_LIGHT)
    slope = np.hypot(row, column)
    steep = float(np.percentile(slope[::3, ::3], 99)) if np.ndim(slope) else 0.0
    factor = np.clip(_CLEAR_SLOPE / max(steep, 1e-9), 1.0, _STEEPEST_EXAGGERATION)
    facing = light[2] - factor * (light[0] * column + light[1] * row)
    shade = facing / np.sqrt(1 + (factor * slope) ** 2) - light[2]
    table = _table()
    rows = np.clip(level, 0, _LEVELS - 1).astype(np.intp)
    columns = np.clip((shade + 1) * (_SHADES / 2), 0, _SHADES - 1).astype(np.intp)
    return np.asarray(table[rows, columns])


def colours(count: int) -> Rgb:
    """(count, 3) uint8 unshaded colours from the lowest to the highest height."""
    return _to_srgb(*_path(np.linspace(0, 1, count)))


def painted(level: NDArray[np.float32]) -> Rgb:
    """Colour numbers from 0 to 1 as :func:`colours` does, without shade.

    Parameters
    ----------
    level : (…) float32
        Beyond, as at the end.

    Returns
    -------
    (…, 3) uint8
        R, G, B.
    """
    table = colours(_LEVELS)
    return np.asarray(table[np.rint(np.clip(level, 0, 1) * (_LEVELS - 1)).astype(np.intp)])


def signed(level: NDArray[np.float32]) -> Rgb:
    """Colour numbers of either sign: blue at −1, white at 0, red at 1; beyond, as at the end.

    Parameters
    ----------
    level : (…) float32

    Returns
    -------
    (…, 3) uint8
        R, G, B; equal steps look equally large on both sides.
    """
    t = np.linspace(-1, 1, 2 * _LEVELS + 1)
    hue = np.radians(np.where(t < 0, _COLD_DEG, _WARM_DEG))
    lightness, chroma = 0.98 - 0.45 * np.abs(t), 0.17 * np.abs(t)
    table = _to_srgb(lightness, chroma * np.cos(hue), chroma * np.sin(hue))
    return np.asarray(table[np.rint((np.clip(level, -1, 1) + 1) * _LEVELS).astype(np.intp)])


def _table() -> Rgb:
    """(levels, shades, 3) colours: each height's colour, from darkest to brightest shade."""
    lightness, a, b = (part[:, None] for part in _path(np.linspace(0, 1, _LEVELS)))
    shade = np.linspace(-1, 1, _SHADES, endpoint=False) * _SHADE_STRENGTH
    dimmed = np.clip(lightness + shade, 0.08, 0.99)
    # a colour that is darkened keeps its look when its chroma shrinks with its lightness
    keep = np.minimum(dimmed / lightness, 1.0)
    return _to_srgb(dimmed, a * keep, b * keep)


def _path(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """OKLab coordinates along the colour bar; lightness rises evenly."""
    lightness = _LOW[0] + (_HIGH[0] - _LOW[0]) * t
    chroma = _LOW[1] + (_HIGH[1] - _LOW[1]) * t + 4 * t * (1 - t) * _MIDDLE_CHROMA
    hue = np.radians(_LOW[2] + (_HIGH[2] - _LOW[2]) * t)
    return lightness, chroma * np.cos(hue), chroma * np.sin(hue)


def _to_srgb(lightness: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> Rgb:
    """OKLab (Ottosson 2020) to 8-bit sRGB."""
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
