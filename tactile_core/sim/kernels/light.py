"""Kernels of :mod:`tactile_core.sim.optics`: from the relief of the gel surface to pixel values.

Every row passes through all steps at once: its buffers fit into the processor's first cache. An
array without rows stands for an absent image.
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
def _normals(relief_mm: Float32, rest: Float32, half: Any, row: int, out: Float32) -> None:
    """Unit normals (3, W) of one row; ``half`` is half a pixel per mm."""
    above, below = max(row - 1, 0), min(row + 1, len(relief_mm) - 1)
    scale = half if below - above == 2 else half + half
    x, y, z = out[0], out[1], out[2]
    _across(relief_mm[row], half, x)
    _down(relief_mm[above], relief_mm[below], scale, y)
    if rest.size:
        _add(rest[0, row], x)
        _add(rest[1, row], y)
    _unit(x, y, z)


@njit(**ROW)
def _lit(
    x: Float32,
    y: Float32,
    z: Float32,
    a: Any,
    b: Any,
    c: Any,
    unit: Float32,
    zero: Float32,
    square: Any,
    out: Float32,
) -> None:
    ua, ub, uc = unit[0], unit[1], unit[2]
    za, zb, zc = zero[0], zero[1], zero[2]
    for j in range(out.size):
        cosine = x[j] * (np.float32(a[j]) * ua + za) + y[j] * (np.float32(b[j]) * ub + zb)
        cosine += z[j] * (np.float32(c[j]) * uc + zc)
        out[j] = cosine + np.sqrt(cosine * cosine + square)


@njit(**ROW)
def _power(
    x: Float32,
    y: Float32,
    z: Float32,
    a: Any,
    b: Any,
    c: Any,
    peak: Any,
    unit: Float32,
    zero: Float32,
    left: Float32,
    power: Any,
) -> None:
    """Split exp's argument into a power of two, as bits of a float, and a remainder."""
    ua, ub, uc, up = unit[3], unit[4], unit[5], unit[6]
    za, zb, zc, zp = zero[3], zero[4], zero[5], zero[6]
    for j in range(left.size):
        value = x[j] * (np.float32(a[j]) * ua + za) + y[j] * (np.float32(b[j]) * ub + zb)
        value += z[j] * (np.float32(c[j]) * uc + zc) + (np.float32(peak[j]) * up + zp)
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
def _add_textured(row: Float32, grain: Float32, level: Any, out: Float32) -> None:
    for j in range(row.size):
        out[j] += row[j] * (grain[j] * level)


@njit(**ROW)
def _apart(every: Any, unit: Any, a: Float32, b: Float32, c: Float32, d: Float32) -> None:
    """Split four interleaved textures."""
    for j in range(a.size):
        a[j] = np.float32(every[4 * j]) * unit
        b[j] = np.float32(every[4 * j + 1]) * unit
        c[j] = np.float32(every[4 * j + 2]) * unit
        d[j] = np.float32(every[4 * j + 3]) * unit


@njit(**ROW)
def _product(a: Float32, b: Float32, out: Float32) -> None:
    for j in range(out.size):
        out[j] = a[j] * b[j]


@njit(**ROW)
def _dim(up: Float32, ambient: Any, clear: Float32, row: Float32) -> None:
    """Add the ambient light, and absorb."""
    half = np.float32(0.5)
    for j in range(row.size):
        row[j] = (row[j] + (half * up[j] + half) * ambient) * clear[j]


@njit(**ROW)
def _dim_by(hidden: Float32, next_hidden: Float32, share: Any, row: Float32) -> None:
    """Darken by a hidden share, interpolated between two rows."""
    one = np.float32(1)
    for j in range(row.size):
        row[j] *= one - (hidden[j] + (next_hidden[j] - hidden[j]) * share)


@njit(**ROW)
def _share_of(row: Float32, share: Any, out: Float32) -> None:
    for j in range(row.size):
        out[j] = row[j] * share


@njit(**ROW)
def _mixed(a: Float32, b: Float32, c: Float32, shares: Float32, out: Float32) -> None:
    of_a, of_b, of_c = shares[0], shares[1], shares[2]
    for j in range(out.size):
        out[j] = a[j] * of_a + b[j] * of_b + c[j] * of_c


@njit(**EXACT_ROW)
def _levels(
    light: Float32, noise: Any, scale: Any, well: Any, read: Any, most: Any, out: Any
) -> None:
    zero, half = np.float32(0), np.float32(0.5)
    for j in range(out.size):
        spread = np.sqrt(max(light[j], zero) * well + read)
        level = (spread * (np.float32(noise[j]) * scale) + light[j]) * most + half
        out[j] = np.uint16(np.int32(min(max(level, zero), most)))


@njit(**EXACT_ROW)
def _coded(levels: Any, table: Any, out: Any) -> None:
    for j in range(levels.size):
        out[j] = table[levels[j]]


@njit(**EXACT_ROW)
def _interleaved(a: Any, b: Any, c: Any, out: Any) -> None:
    for j in range(a.size):
        out[3 * j] = a[j]
        out[3 * j + 1] = b[j]
        out[3 * j + 2] = c[j]


@njit(**LOOP)
def photograph(
    surface: tuple[Float32, Float32, Any, float, Float32, float],
    lights: tuple[Any, Float32, Float32, Float32],
    lit: tuple[Any, Float32, Any],
    shade: tuple[Float32, int, Any, Any],
    ambient: Float32,
    glass: Float32,
    mixing: Float32,
    noise: tuple[Any, Float32],
    electrons: tuple[float, float],
    table: Any,
    pixels: Any,
) -> None:
    """Take the exposures of a frame.

    Parameters
    ----------
    surface : relief_mm, rest, textures, texture_unit, printed, mm_per_px
        (H, W) relief, at least 2 × 2; (2, H, W) or (2, 0, 0) slopes of the undeformed surface;
        (T, H, W, 4) textures of four lights each, and their unit; (H, W) or (0, 0) reflectance
        of the print.
    lights : planes, unit, zero, blur
        As in :class:`~tactile_core.sim.optics.quick.StackedLights`, of S lights: (S, P, H, W)
        int16, where P is 3 or 7; (S, P, H), (S, P, H), and (S,).
    lit : numbers, levels, fed
        Of the L lights that are on, in any exposure: (L,) int indices, (L,) float32 brightness,
        and (L, E K) bool channels that receive them, of K colours of E exposures.
    shade : hidden, left, first, share
        (L, h, w) hidden share of each light on some coarse rows of a part of the image; the first
        column of that part; and for each of the H rows, the coarse row before it and the fraction
        of the way to the next one. -1 marks a row without shadows.
    ambient : (E K,) float32
    glass : (H, W) float32
        Transmission of the lens.
    mixing : (K, K) float32
        One or three colours.
    noise : (E K, H, W) int8 and (E K,) float32
        Standard normal samples, and their unit with their sign.
    electrons : (float, float)
        Noise variance at full light (shot noise) and without light (read noise), relative to full
        scale.
    table : (V,) uint8 or uint16
        Pixel value of each of V light levels.
    pixels : (E, H, W K) uint8 or uint16
        Overwritten.
    """
    relief_mm, rest, textures, texture_unit, printed, mm_per_px = surface
    unit_of_grain = np.float32(texture_unit)
    planes, units, zeros, blur = lights
    numbers, levels, fed = lit
    hidden, left, coarse, share = shade
    samples, scales = noise
    most = np.float32(table.size - 1)
    rows, columns = relief_mm.shape
    count, colours = len(ambient), len(mixing)
    half = np.float32(0.5 / mm_per_px)
    well, read = np.float32(electrons[0]), np.float32(electrons[1])
    facing = np.empty((3, columns), np.float32)
    grain = np.empty((4 * len(textures), columns), np.float32)
    used = np.zeros(len(textures), np.bool_)
    for k in range(len(numbers)):
        used[numbers[k] // 4] = True
    plane, rest_of = np.empty(columns, np.float32), np.empty(columns, np.float32)
    power = np.empty(columns, np.int32)
    light = np.empty((count, columns), np.float32)
    covered = np.empty(columns, np.float32)
    mixed, levels_of = np.empty(columns, np.float32), np.empty(columns, np.uint16)
    coded = np.empty((colours, columns), pixels.dtype)
    for row in range(rows):
        _normals(relief_mm, rest, half, row, facing)
        x, y, z = facing[0], facing[1], facing[2]
        for t in range(len(textures)):
            if used[t]:
                four = textures[t, row].reshape(4 * columns)
                _apart(
                    four,
                    unit_of_grain,
                    grain[4 * t],
                    grain[4 * t + 1],
                    grain[4 * t + 2],
                    grain[4 * t + 3],
                )
        light[:] = 0
        for k in range(len(numbers)):
            s = numbers[k]
            square = np.float32(blur[s] * blur[s])
            unit, zero = units[s, :, row], zeros[s, :, row]
            a, b, c = planes[s, 0, row], planes[s, 1, row], planes[s, 2, row]
            _lit(x, y, z, a, b, c, unit, zero, square, plane)
            if planes.shape[1] > 3:
                a, b, c = planes[s, 3, row], planes[s, 4, row], planes[s, 5, row]
                _power(x, y, z, a, b, c, planes[s, 6, row], unit, zero, rest_of, power)
                _add_exponential(rest_of, power.view(np.float32), plane)
            before = coarse[row]
            if before >= 0:
                after = min(before + 1, hidden.shape[1] - 1)
                part = plane[left : left + hidden.shape[2]]
                _dim_by(hidden[k, before], hidden[k, after], share[row], part)
            for channel in range(count):
                if fed[k, channel]:
                    _add_textured(plane, grain[s], levels[k], light[channel])
        clear = glass[row]
        if printed.size:
            _product(printed[row], clear, covered)
            clear = covered
        for channel in range(count):
            _dim(z, ambient[channel], clear, light[channel])
        for channel in range(count):
            colour = channel % colours
            if colours == 3:
                first = channel - colour
                _mixed(light[first], light[first + 1], light[first + 2], mixing[colour], mixed)
            else:
                _share_of(light[channel], mixing[0, 0], mixed)
            scale, numbers_of = scales[channel], samples[channel, row]
            _levels(mixed, numbers_of, scale, well, read, most, levels_of)
            out = pixels[channel // colours, row]
            if colours == 3:
                _coded(levels_of, table, coded[colour])
                if colour == 2:
                    _interleaved(coded[0], coded[1], coded[2], out)
            else:
                _coded(levels_of, table, out)
