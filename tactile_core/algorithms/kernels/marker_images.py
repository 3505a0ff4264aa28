"""Kernels of the marker contrast and the marker mask.

Bytes are rounded as OpenCV rounds them, so that both ways give the same images.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.kernels.dilation import dilated, invert_row
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP
from tactile_core.algorithms.kernels.rows import copy_row


@njit(inline="always")
def _third(a: Any, b: Any, c: Any) -> Any:
    return (a + b + c + np.uint16(1)) // np.uint16(3)


@njit(inline="always")
def _quarter(a: Any, b: Any, c: Any, d: Any) -> Any:
    total = np.uint16(a) + np.uint16(b) + np.uint16(c) + np.uint16(d)
    return (total + np.uint16(2)) // np.uint16(4)


@njit(**EXACT_ROW)
def _mean_row(pixels: UInt8, mean: UInt8) -> None:
    for j in range(mean.size):
        mean[j] = _third(
            np.uint16(pixels[3 * j]), np.uint16(pixels[3 * j + 1]), np.uint16(pixels[3 * j + 2])
        )


@njit(**EXACT_ROW)
def _halved_mean_row(upper: UInt8, lower: UInt8, mean: UInt8) -> None:
    for j in range(mean.size):
        k = 6 * j
        mean[j] = _third(
            _quarter(upper[k], upper[k + 3], lower[k], lower[k + 3]),
            _quarter(upper[k + 1], upper[k + 4], lower[k + 1], lower[k + 4]),
            _quarter(upper[k + 2], upper[k + 5], lower[k + 2], lower[k + 5]),
        )


@njit(**EXACT_ROW)
def _contrast_row(inverse: UInt8, brightness: UInt8, darkest: Any, contrast: UInt8) -> None:
    for j in range(contrast.size):
        around = np.float32(max(np.uint8(~inverse[j]), darkest))
        lost = max(around - np.float32(brightness[j]), np.float32(0))
        contrast[j] = np.uint8(np.rint(lost * np.float32(255) / around))


@njit(**LOOP)
def contrast_of_colours(pixels: UInt8, reach: int, darkest: UInt8, contrast: UInt8) -> None:
    """Divide the light that each pixel lacks by that of its background.

    Parameters
    ----------
    pixels : (H, 3 W) uint8
        Interleaved channels, of which the mean counts.
    reach : int
        The background is closed by a square of 2 reach + 1 pixels.
    darkest : uint8
        Lower bound of the background, above 0.
    contrast : (H, W) or (H / 2, W / 2) uint8
        The result, of the image or of its means over 2 × 2 pixels: 255 for a pixel without any
        light.
    """
    rows, columns = contrast.shape
    halves = len(pixels) != rows
    stride = columns + 2 * reach
    start = 2 * reach * (stride + 1)
    size = start + (rows + 2 * reach) * stride
    flat, spare = np.zeros(size, np.uint8), np.empty(size, np.uint8)
    brightness = np.empty((rows, columns), np.uint8)
    for i in range(rows):
        if halves:
            _halved_mean_row(pixels[2 * i], pixels[2 * i + 1], brightness[i])
        else:
            _mean_row(pixels[i], brightness[i])
        copy_row(brightness[i], flat[start + i * stride :])
    light, spare = dilated(flat, spare, reach, stride)
    inverse = np.zeros(size, np.uint8)
    earlier = reach * (stride + 1)
    for i in range(rows):
        at = start + i * stride
        invert_row(light[at - earlier :], inverse[at : at + columns])
    inverse, spare = dilated(inverse, spare, reach, stride)
    for i in range(rows):
        at = start + i * stride
        _contrast_row(inverse[at - earlier :], brightness[i], darkest, contrast[i])


@njit(**EXACT_ROW)
def _either_row(row: UInt8, other: UInt8, least: UInt8, dark: UInt8) -> None:
    for j in range(dark.size):
        dark[j] = (row[j] > least) | (other[j] > least)


@njit(**EXACT_ROW)
def _doubled_row(dark: UInt8, mask: UInt8) -> None:
    last = dark.size - 1
    mask[0], mask[2 * last + 1] = dark[0], dark[last]
    for j in range(last):
        both = dark[j] | dark[j + 1]
        mask[2 * j + 1] = both
        mask[2 * j + 2] = both


@njit(**EXACT_ROW)
def _any_row(above: UInt8, row: UInt8, below: UInt8, least: UInt8, dark: UInt8) -> None:
    for j in range(dark.size):
        dark[j] = (above[j] > least) | (row[j] > least) | (below[j] > least)


@njit(**EXACT_ROW)
def _near_row(dark: UInt8, mask: UInt8) -> None:
    for j in range(mask.size):
        mask[j] = dark[j] | dark[j + 1] | dark[j + 2]


@njit(**LOOP)
def dark_mask(contrast: UInt8, least: UInt8, mask: UInt8) -> None:
    """Threshold the contrast, double it if the mask is twice as large, and add a rim of one pixel.

    Parameters
    ----------
    contrast : (h, w) uint8
    least : uint8
        A pixel above it is dark.
    mask : (h, w) or (2 h, 2 w) uint8
        The result, 0 or 1.
    """
    rows, columns = contrast.shape
    if len(mask) == rows:
        # with a column at each side that is never dark
        padded = np.zeros(columns + 2, np.uint8)
        for i in range(rows):
            above, below = contrast[max(i - 1, 0)], contrast[min(i + 1, rows - 1)]
            _any_row(above, contrast[i], below, least, padded[1 : columns + 1])
            _near_row(padded, mask[i])
        return
    dark = np.empty(columns, np.uint8)
    for i in range(rows + 1):
        # a rim of half a cell joins each row of cells to the next
        upper, lower = max(i - 1, 0), min(i, rows - 1)
        _either_row(contrast[upper], contrast[lower], least, dark)
        if i > 0:
            _doubled_row(dark, mask[2 * i - 1])
        if i < rows:
            _doubled_row(dark, mask[2 * i])
