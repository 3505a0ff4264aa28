"""Kernel of :mod:`tactile_core.sim.optics.camera`: what JPEG does to a colour image.

The lossless coding of the coefficients is left out. All else is the integer arithmetic of libjpeg,
so that the result is the same, bit by bit: chroma of half the size, discrete cosine transform,
quantisation, and back. Eight rows pass at once; samples with the same place in their 8 × 8 blocks
are adjacent in the buffer, so that the compiler vectorises over blocks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP
from tactile_core.sim.kernels.light import interleaved

_LANES = 48
"""Blocks that are transformed at once."""
_SHARES = np.array(
    [
        [19595, 38470, 7471, 1 << 15],
        [-11059, -21709, 32768, (128 << 16) + (1 << 15) - 1],
        [32768, -27439, -5329, (128 << 16) + (1 << 15) - 1],
    ],
    np.int32,
)
"""Shares of red, green and blue in luma and in both chromas, and a constant; 16 bits after the
point."""
_CHROMA = np.array([[0, 91881], [-22554, -46802], [116130, 0]], np.int32)
"""Shares of both chromas in red, green and blue."""
_ROW = 8 * _LANES
"""Distance of rows of a block in the buffer."""


# numba adds and multiplies in 64 bits: back to 32 after each step, so that twice as many fit
@njit(inline="always", **LOOP)
def _sum(a: Any, b: Any) -> Any:
    return np.int32(a + b)


@njit(inline="always", **LOOP)
def _difference(a: Any, b: Any) -> Any:
    return np.int32(a - b)


@njit(inline="always", **LOOP)
def _product(a: Any, factor: int) -> Any:
    return np.int32(a * np.int32(factor))


@njit(inline="always", **LOOP)
def _rounded(value: Any, bits: int) -> Any:
    return np.int32(np.int32(value + np.int32(1 << (bits - 1))) >> np.int32(bits))


@njit(inline="always", **LOOP)
def _byte(value: Any) -> Any:
    return np.uint8(min(max(value, np.int32(0)), np.int32(255)))


@njit(**EXACT_ROW)
def _apart(pixels: Any, red: Any, green: Any, blue: Any) -> None:
    for j in range(red.size):
        red[j], green[j], blue[j] = pixels[3 * j], pixels[3 * j + 1], pixels[3 * j + 2]


@njit(**EXACT_ROW)
def _shares(red: Any, green: Any, blue: Any, shares: Any, out: Any) -> None:
    """Luma or chroma of a row, from shares of the colours with 16 bits after the point."""
    of_red, of_green, of_blue, constant = shares[0], shares[1], shares[2], shares[3]
    for j in range(out.size):
        r, g = np.int32(np.int32(red[j]) * of_red), np.int32(np.int32(green[j]) * of_green)
        total = _sum(_sum(r, g), np.int32(np.int32(blue[j]) * of_blue))
        out[j] = np.int16(_sum(total, constant) >> np.int32(16))


@njit(**EXACT_ROW)
def _halved(above: Any, below: Any, out: Any) -> None:
    for j in range(out.size):
        upper = _sum(np.int32(above[2 * j]), np.int32(above[2 * j + 1]))
        lower = _sum(np.int32(below[2 * j]), np.int32(below[2 * j + 1]))
        total = _sum(_sum(upper, lower), np.int32(1 + (j & 1)))
        out[j] = np.int16(total >> np.int32(2))


@njit(**EXACT_ROW)
def _fill(row: Any, count: int, buffer: Any) -> None:
    for b in range(count):
        for k in range(8):
            buffer[k * _LANES + b] = np.int32(row[8 * b + k]) - np.int32(128)


@njit(**EXACT_ROW)
def _empty(buffer: Any, count: int, row: Any) -> None:
    for b in range(count):
        for k in range(8):
            row[8 * b + k] = np.uint8(buffer[k * _LANES + b])


@njit(inline="always", **LOOP)
def _rotated(p: Any, q: Any, r: Any, s: Any) -> Any:
    """Odd part of both transforms."""
    z1, z2, z3, z4 = _sum(p, s), _sum(q, r), _sum(p, r), _sum(q, s)
    z5 = _product(_sum(z3, z4), 9633)
    z1, z2 = _product(z1, -7373), _product(z2, -20995)
    z3, z4 = _sum(_product(z3, -16069), z5), _sum(_product(z4, -3196), z5)
    return (
        _sum(_product(p, 2446), _sum(z1, z3)),
        _sum(_product(q, 16819), _sum(z2, z4)),
        _sum(_product(r, 25172), _sum(z2, z3)),
        _sum(_product(s, 12299), _sum(z1, z4)),
    )


@njit(inline="always", **LOOP)
def _forward(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Cosine transform of eight samples: all but the first and fifth with 13 bits more."""
    s0, s1, s2, s3 = _sum(a, h), _sum(b, g), _sum(c, f), _sum(d, e)
    even, odd, s12, s03 = _sum(s0, s3), _sum(s1, s2), _difference(s1, s2), _difference(s0, s3)
    z = _product(_sum(s12, s03), 4433)
    d0, d1, d2, d3 = _difference(a, h), _difference(b, g), _difference(c, f), _difference(d, e)
    o7, o5, o3, o1 = _rotated(d3, d2, d1, d0)
    o2, o6 = _sum(z, _product(s03, 6270)), _difference(z, _product(s12, 15137))
    return _sum(even, odd), o1, o2, o3, _difference(even, odd), o5, o6, o7


@njit(inline="always", **LOOP)
def _back(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    """Inverse of :func:`_forward` up to a factor, all with 13 bits more."""
    z = _product(_sum(c, g), 4433)
    low, high = _difference(z, _product(g, 15137)), _sum(z, _product(c, 6270))
    total, rest = _product(_sum(a, e), 8192), _product(_difference(a, e), 8192)
    e0, e3, e1, e2 = (
        _sum(total, high),
        _difference(total, high),
        _sum(rest, low),
        _difference(rest, low),
    )
    o0, o1, o2, o3 = _rotated(h, f, d, b)
    return (
        _sum(e0, o3),
        _sum(e1, o2),
        _sum(e2, o1),
        _sum(e3, o0),
        _difference(e3, o0),
        _difference(e2, o1),
        _difference(e1, o2),
        _difference(e0, o3),
    )


@njit(**EXACT_ROW)
def _rows_forward(x: Any, count: int) -> None:
    n = _LANES
    for j in range(count):
        a, b, c, d, e, f, g, h = _forward(
            x[j],
            x[n + j],
            x[2 * n + j],
            x[3 * n + j],
            x[4 * n + j],
            x[5 * n + j],
            x[6 * n + j],
            x[7 * n + j],
        )
        x[j], x[4 * n + j] = _product(a, 4), _product(e, 4)
        x[n + j], x[2 * n + j], x[3 * n + j] = _rounded(b, 11), _rounded(c, 11), _rounded(d, 11)
        x[5 * n + j], x[6 * n + j] = _rounded(f, 11), _rounded(g, 11)
        x[7 * n + j] = _rounded(h, 11)


@njit(**EXACT_ROW)
def _columns_forward(x: Any, count: int) -> None:
    n = _ROW
    for j in range(count):
        a, b, c, d, e, f, g, h = _forward(
            x[j],
            x[n + j],
            x[2 * n + j],
            x[3 * n + j],
            x[4 * n + j],
            x[5 * n + j],
            x[6 * n + j],
            x[7 * n + j],
        )
        x[j], x[4 * n + j] = _rounded(a, 2), _rounded(e, 2)
        x[n + j], x[2 * n + j], x[3 * n + j] = _rounded(b, 15), _rounded(c, 15), _rounded(d, 15)
        x[5 * n + j], x[6 * n + j] = _rounded(f, 15), _rounded(g, 15)
        x[7 * n + j] = _rounded(h, 15)


@njit(**EXACT_ROW)
def _quantised(x: Any, step: Any, count: int) -> None:
    """Round to multiples of a step; the transform has a factor of eight."""
    # half a unit more, so that the reciprocal's rounding does not matter
    share, half = np.float32(0.125) / step, np.float32(4) * step + np.float32(0.5)
    for j in range(count):
        value = np.float32(x[j])
        whole = np.float32(np.int32((abs(value) + half) * share)) * step
        x[j] = np.int32(whole if value >= 0 else -whole)


@njit(**EXACT_ROW)
def _columns_back(x: Any, count: int) -> None:
    n = _ROW
    for j in range(count):
        a, b, c, d, e, f, g, h = _back(
            x[j],
            x[n + j],
            x[2 * n + j],
            x[3 * n + j],
            x[4 * n + j],
            x[5 * n + j],
            x[6 * n + j],
            x[7 * n + j],
        )
        x[j], x[n + j], x[2 * n + j] = _rounded(a, 11), _rounded(b, 11), _rounded(c, 11)
        x[3 * n + j], x[4 * n + j] = _rounded(d, 11), _rounded(e, 11)
        x[5 * n + j], x[6 * n + j], x[7 * n + j] = (
            _rounded(f, 11),
            _rounded(g, 11),
            _rounded(h, 11),
        )


@njit(**EXACT_ROW)
def _rows_back(x: Any, count: int) -> None:
    n = _LANES
    for j in range(count):
        a, b, c, d, e, f, g, h = _back(
            x[j],
            x[n + j],
            x[2 * n + j],
            x[3 * n + j],
            x[4 * n + j],
            x[5 * n + j],
            x[6 * n + j],
            x[7 * n + j],
        )
        x[j] = _byte(_sum(_rounded(a, 18), np.int32(128)))
        x[n + j] = _byte(_sum(_rounded(b, 18), np.int32(128)))
        x[2 * n + j] = _byte(_sum(_rounded(c, 18), np.int32(128)))
        x[3 * n + j] = _byte(_sum(_rounded(d, 18), np.int32(128)))
        x[4 * n + j] = _byte(_sum(_rounded(e, 18), np.int32(128)))
        x[5 * n + j] = _byte(_sum(_rounded(f, 18), np.int32(128)))
        x[6 * n + j] = _byte(_sum(_rounded(g, 18), np.int32(128)))
        x[7 * n + j] = _byte(_sum(_rounded(h, 18), np.int32(128)))


@njit(**LOOP)
def _strip(rows: Any, steps: Any, buffer: Any, out: Any) -> None:
    """Transform, quantise and transform back eight rows of samples."""
    blocks = rows.shape[1] // 8
    for first in range(0, blocks, _LANES):
        count = min(_LANES, blocks - first)
        for r in range(8):
            _fill(rows[r][8 * first :], count, buffer[r * _ROW :])
            _rows_forward(buffer[r * _ROW :], count)
        for k in range(8):
            _columns_forward(buffer[k * _LANES :], count)
        for place in range(64):
            _quantised(buffer[place * _LANES :], np.float32(steps[place]), count)
        for k in range(8):
            _columns_back(buffer[k * _LANES :], count)
        for r in range(8):
            _rows_back(buffer[r * _ROW :], count)
            _empty(buffer[r * _ROW :], count, out[r][8 * first :])


@njit(**EXACT_ROW)
def _leaning(near: Any, far: Any, out: Any) -> None:
    for j in range(near.size):
        out[j] = np.int16(_sum(_product(np.int32(near[j]), 3), np.int32(far[j])))


@njit(**EXACT_ROW)
def _doubled(row: Any, even: Any, odd: Any) -> None:
    """Twice as many samples of a row: those of even and of odd places."""
    last = row.size - 1
    even[0], odd[last] = (4 * row[0] + 8) >> 4, (4 * row[last] + 7) >> 4
    for j in range(last):
        this, following = np.int32(row[j]), np.int32(row[j + 1])
        to_the_left = _sum(_sum(_product(this, 3), following), np.int32(7))
        to_the_right = _sum(_sum(_product(following, 3), this), np.int32(8))
        odd[j] = np.int16(to_the_left >> np.int32(4))
        even[j + 1] = np.int16(to_the_right >> np.int32(4))


@njit(**EXACT_ROW)
def _by_turns(even: Any, odd: Any, out: Any) -> None:
    for j in range(even.size):
        out[2 * j], out[2 * j + 1] = even[j], odd[j]


@njit(**EXACT_ROW)
def _coloured(luma: Any, of_blue: Any, of_red: Any, shares: Any, out: Any) -> None:
    """One colour of a row, from luma and shares of chroma with 16 bits after the point."""
    by_blue, by_red = shares[0], shares[1]
    for j in range(luma.size):
        u = _difference(np.int32(of_blue[j]), np.int32(128))
        v = _difference(np.int32(of_red[j]), np.int32(128))
        more = _sum(np.int32(u * by_blue), np.int32(v * by_red))
        out[j] = _byte(_sum(np.int32(luma[j]), _rounded(more, 16)))


@njit(**LOOP)
def transmit(pixels: Any, steps: Any, out: Any) -> None:
    """Compress an image and decompress it.

    Parameters
    ----------
    pixels : (H, 3 W) uint8
        Red, green and blue by turns. H and W are multiples of 16.
    steps : (2, 64) int32
        Quantisation of luma and chroma: of eight rows of eight coefficients.
    out : (H, 3 W) uint8
        Overwritten.
    """
    height, width = len(pixels), pixels.shape[1] // 3
    buffer = np.empty(8 * _ROW, np.int32)
    luma = np.empty((height, width), np.uint8)
    chroma = np.empty((2, height // 2, width // 2), np.uint8)
    bright = np.empty((16, width), np.int16)
    tint = np.empty((2, 2, width), np.int16)
    colours = np.empty((3, width), np.uint8)
    small = np.empty((2, 8, width // 2), np.int16)
    for top in range(0, height, 16):
        for i in range(0, 16, 2):
            for k in range(2):
                _apart(pixels[top + i + k], colours[0], colours[1], colours[2])
                r, g, b = colours[0], colours[1], colours[2]
                _shares(r, g, b, _SHARES[0], bright[i + k])
                _shares(r, g, b, _SHARES[1], tint[0, k])
                _shares(r, g, b, _SHARES[2], tint[1, k])
            for part in range(2):
                _halved(tint[part, 0], tint[part, 1], small[part, i // 2])
        _strip(bright[:8], steps[0], buffer, luma[top : top + 8])
        _strip(bright[8:], steps[0], buffer, luma[top + 8 : top + 16])
        for part in range(2):
            _strip(small[part], steps[1], buffer, chroma[part, top // 2 : top // 2 + 8])
    half = np.empty((3, width // 2), np.int16)
    wide = np.empty((2, width), np.int16)
    for row in range(height):
        near = row // 2
        far = near + 1 if row % 2 else near - 1
        far = min(max(far, 0), height // 2 - 1)
        for part in range(2):
            _leaning(chroma[part, near], chroma[part, far], half[0])
            _doubled(half[0], half[1], half[2])
            _by_turns(half[1], half[2], wide[part])
        for colour in range(3):
            _coloured(luma[row], wide[0], wide[1], _CHROMA[colour], colours[colour])
        interleaved(colours[0], colours[1], colours[2], out[row])
