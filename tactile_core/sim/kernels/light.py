"""Kernels of :mod:`tactile_core.sim.optics`: from the relief of the gel surface to pixel values.

Each call processes a band of rows. Buffers have the size of the band, images that of the whole
frame. An array without rows stands for an absent image.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, ROW

_LOG2_E = np.float32(1.4426950408889634)
"""log2(e)."""
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
"""ln 2 as the sum of two numbers, so that multiples of the first are exact in float32."""


@njit(**ROW)
def _across(row: Float32, half: Any, out: Float32) -> None:
    last = row.size - 1
    for j in range(1, last):
        out[j] = (row[j + 1] - row[j - 1]) * half
    out[0] = (row[1] - row[0]) * (half + half)
    out[last] = (row[last] - row[last - 1]) * (half + half)


@njit(**ROW)
def _down(above: Float32, below: Float32, scale: Any, out: Float32) -> None:
    for j in range(out.size):
        out[j] = (below[j] - above[j]) * scale


@njit(**ROW)
def _add(row: Float32, out: Float32) -> None:
    for j in range(out.size):
        out[j] += row[j]


@njit(**ROW)
def _unit(x: Float32, y: Float32, z: Float32) -> None:
    one = np.float32(1)
    for j in range(x.size):
        up = one / np.sqrt(x[j] * x[j] + y[j] * y[j] + one)
        x[j] *= -up
        y[j] *= -up
        z[j] = up


@njit(**LOOP)
def normals(relief_mm: Float32, rest: Float32, mm_per_px: float, top: int, out: Float32) -> None:
    """Unit normals of a band.

    Parameters
    ----------
    relief_mm : (H, W) float32
        At least 2 × 2.
    rest : (2, H, W) or (2, 0, 0) float32
        Slopes of the undeformed surface.
    mm_per_px : float
    top : int
        First row of the band.
    out : (3, h, W) float32
        Overwritten.
    """
    half = np.float32(0.5 / mm_per_px)
    last = len(relief_mm) - 1
    for i in range(out.shape[1]):
        row = top + i
        above, below = max(row - 1, 0), min(row + 1, last)
        scale = half if below - above == 2 else half + half
        x, y, z = out[0, i], out[1, i], out[2, i]
        _across(relief_mm[row], half, x)
        _down(relief_mm[above], relief_mm[below], scale, y)
        if rest.size:
            _add(rest[0, row], x)
            _add(rest[1, row], y)
        _unit(x, y, z)


@njit(**ROW)
def _lit(
    x: Float32, y: Float32, z: Float32, a: Float32, b: Float32, c: Float32, square: Any, out: Any
) -> None:
    half = np.float32(0.5)
    for j in range(out.size):
        cosine = x[j] * a[j] + y[j] * b[j] + z[j] * c[j]
        out[j] = half * (cosine + np.sqrt(cosine * cosine + square))


@njit(**ROW)
def _power(
    x: Float32,
    y: Float32,
    z: Float32,
    a: Float32,
    b: Float32,
    c: Float32,
    peak: Float32,
    left: Float32,
    power: Any,
) -> None:
    """Split exp's argument into a power of two, as bits of a float, and a remainder."""
    for j in range(left.size):
        value = x[j] * a[j] + y[j] * b[j] + z[j] * c[j] + peak[j]
        value = min(max(value, np.float32(-80)), np.float32(80))
        whole = np.floor(value * _LOG2_E + np.float32(0.5))
        left[j] = (value - whole * _LN2_HIGH) - whole * _LN2_LOW
        power[j] = (np.int32(whole) + np.int32(127)) << np.int32(23)


@njit(**ROW)
def _add_exponential(left: Float32, power: Float32, out: Float32) -> None:
    for j in range(out.size):
        r = left[j]
        p = np.float32(1 / 720)
        p = p * r + np.float32(1 / 120)
        p = p * r + np.float32(1 / 24)
        p = p * r + np.float32(1 / 6)
        p = p * r + np.float32(1 / 2)
        p = p * r + np.float32(1)
        out[j] += (p * r + np.float32(1)) * power[j]


@njit(**ROW)
def _scale(by: Float32, row: Float32) -> None:
    for j in range(row.size):
        row[j] *= by[j]


@njit(**ROW)
def _scale_by_every(grain: Float32, number: Any, count: Any, level: Any, row: Float32) -> None:
    for j in range(row.size):
        row[j] *= grain[j * count + number] * level


@njit(**LOOP)
def add_light(
    facing: Float32,
    toward: Float32,
    lobe: Float32,
    peak: Float32,
    blur: float,
    seen: Float32,
    grain: tuple[Float32, int],
    level: float,
    fed: Any,
    top: int,
    light: Float32,
) -> None:
    """Add the reflection of one light to a band.

    Parameters
    ----------
    facing : (3, h, W) float32
        Normals of the band.
    toward, lobe, peak, blur
        As in :class:`~tactile_core.sim.optics.coating.Shading`.
    seen : (H, W) or (0, 0) float32
        Visible share of the light at each pixel (1 minus shadow).
    grain : (H, W, C) float32 and int
        Textures, and the index of this light's.
    level : float
        Brightness.
    fed : (K,) bool
        Channels that receive this light.
    top : int
        First row of the band.
    light : (K, h, W) float32
        Incremented.
    """
    textures, number = grain
    rows, columns = facing.shape[1:]
    count = textures.shape[2]
    plane, left = np.empty(columns, np.float32), np.empty(columns, np.float32)
    power = np.empty(columns, np.int32)
    square = np.float32(blur * blur)
    for i in range(rows):
        row = top + i
        x, y, z = facing[0, i], facing[1, i], facing[2, i]
        _lit(x, y, z, toward[0, row], toward[1, row], toward[2, row], square, plane)
        if peak.size:
            _power(x, y, z, lobe[0, row], lobe[1, row], lobe[2, row], peak[row], left, power)
            _add_exponential(left, power.view(np.float32), plane)
        if seen.size:
            _scale(seen[row], plane)
        _scale_by_every(
            textures[row].reshape(columns * count), number, count, np.float32(level), plane
        )
        for channel in range(len(fed)):
            if fed[channel]:
                _add(plane, light[channel, i])


@njit(**ROW)
def _add_sky(up: Float32, ambient: Any, row: Float32) -> None:
    half = np.float32(0.5)
    for j in range(row.size):
        row[j] += (half * up[j] + half) * ambient


@njit(**ROW)
def _add_share(row: Float32, share: Any, out: Float32) -> None:
    for j in range(row.size):
        out[j] += row[j] * share


@njit(**ROW)
def _interleave(row: Float32, first: Any, count: Any, out: Float32) -> None:
    for j in range(row.size):
        out[j * count + first] = row[j]


@njit(**EXACT_ROW)
def _levels(
    light: Float32, noise: Float32, sign: Any, well: Any, read: Any, most: Any, out: Any
) -> None:
    zero, half = np.float32(0), np.float32(0.5)
    for j in range(out.size):
        spread = np.sqrt(max(light[j], zero) * well + read)
        level = (spread * (sign * noise[j]) + light[j]) * most + half
        out[j] = np.int32(min(max(level, zero), most))


@njit(**EXACT_ROW)
def _coded(levels: Any, table: Any, out: Any) -> None:
    for j in range(levels.size):
        out[j] = table[levels[j]]


@njit(**LOOP)
def read_out(
    light: Float32,
    up: Float32,
    ambient: Float32,
    dimming: tuple[Float32, Float32],
    mixing: Float32,
    noise: tuple[Float32, float],
    electrons: tuple[float, float],
    table: Any,
    top: int,
    pixels: Any,
) -> None:
    """Convert a band's light to pixel values.

    Parameters
    ----------
    light : (K, h, W) float32
        Reflection of all lights; overwritten.
    up : (h, W) float32
        Third component of the normals.
    ambient : (K,) float32
    dimming : (H, W) float32 and (H, W) or (0, 0) float32
        Transmission of the lens, and reflectance of the printed surface.
    mixing : (K, K) float32
    noise : (H, W K) float32 and float
        Standard normal samples, and their sign.
    electrons : (float, float)
        Noise variance at full light (shot noise) and without light (read noise), relative to full
        scale.
    table : (L,) uint8 or uint16
        Pixel value of each of L light levels.
    top : int
        First row of the band.
    pixels : (H, W K) uint8 or uint16
        Overwritten in the band.
    """
    glass, covered = dimming
    numbers, sign = noise
    count, rows, columns = light.shape
    well, read = np.float32(electrons[0]), np.float32(electrons[1])
    most = np.float32(table.size - 1)
    mixed, every = np.empty(columns, np.float32), np.empty(columns * count, np.float32)
    levels = np.empty(columns * count, np.int32)
    for i in range(rows):
        row = top + i
        for channel in range(count):
            _add_sky(up[i], ambient[channel], light[channel, i])
            if covered.size:
                _scale(covered[row], light[channel, i])
            _scale(glass[row], light[channel, i])
        for channel in range(count):
            mixed[:] = 0
            for other in range(count):
                _add_share(light[other, i], mixing[channel, other], mixed)
            _interleave(mixed, channel, count, every)
        # one long loop over all channels, rather than one with gaps for each
        _levels(every, numbers[row], np.float32(sign), well, read, most, levels)
        _coded(levels, table, pixels[row])
