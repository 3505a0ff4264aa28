"""Dilation of flat images by squares, for other kernels.

A flat image has a gap after each row, so that one loop passes over the whole image, and a window at
the end of a row ends in the gap. A gap that is 0 does not count.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.kernels.options import EXACT_ROW, PART


@njit(**EXACT_ROW)
def _largest_of(a: Any, b: Any, c: Any, d: Any, e: Any, out: Any) -> None:
    for j in range(e.size):
        out[j] = max(max(max(a[j], b[j]), max(c[j], d[j])), e[j])


@njit(**PART)
def _largest_in(values: Any, spare: Any, width: int, step: int) -> tuple[Any, Any]:
    """Largest value of the window that begins at each place of a flat array.

    Parameters
    ----------
    values, spare : (N,) integer
        Both are overwritten.
    width : int
        Places in a window.
    step : int
        Distance of neighbours in a window: 1 along a row, and the length of a row across rows.

    Returns
    -------
    result, spare : (N,) integer
        The last ``(width - 1) * step`` places of the result are undefined.
    """
    wide = 1
    while wide < width:
        # a window up to five times as wide consists of five, which may overlap
        wider = min(5 * wide, width)
        last = (wider - wide) * step
        next_one = wide * step
        one, two, three = min(next_one, last), min(2 * next_one, last), min(3 * next_one, last)
        _largest_of(values, values[one:], values[two:], values[three:], values[last:], spare)
        values, spare, wide = spare, values, wider
    return values, spare


@njit(**PART)
def dilated(flat: UInt8, spare: UInt8, reach: int, stride: int) -> tuple[Any, Any]:
    """Dilate a flat image by a square.

    Parameters
    ----------
    flat, spare : (N,) uint8
        Both are overwritten.
    reach : int
        The square has 2 reach + 1 pixels across and down.
    stride : int
        From a row to the next.

    Returns
    -------
    result, spare : (N,) uint8
        The result begins ``reach`` rows and columns earlier.
    """
    flat, spare = _largest_in(flat, spare, 2 * reach + 1, 1)
    flat, spare = _largest_in(flat, spare, 2 * reach + 1, stride)
    return flat, spare


@njit(**EXACT_ROW)
def invert_row(source: UInt8, target: UInt8) -> None:
    """Turn maxima into minima: an erosion is a dilation of the inverse."""
    for j in range(target.size):
        target[j] = ~source[j]
