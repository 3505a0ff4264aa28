"""Kernel of :mod:`tactile_core.algorithms.markers.spot_pixels`: pixels of dark spots.

Every intermediate image is flat; see :mod:`tactile_core.algorithms.kernels.dilation`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import UInt8
from tactile_core.algorithms.kernels.dilation import dilated, invert_row
from tactile_core.algorithms.kernels.edges import reflected
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART
from tactile_core.algorithms.kernels.rows import copy_row

_FULL = 255
"""The largest byte."""


@njit(**EXACT_ROW)
def _sum_rows(a: UInt8, b: UInt8, middle: UInt8, d: UInt8, e: UInt8, taps: Any, line: Any) -> None:
    far, near, here = taps
    for j in range(middle.size):
        outer, inner = np.uint16(a[j]) + np.uint16(e[j]), np.uint16(b[j]) + np.uint16(d[j])
        line[j + 2] = far * outer + near * inner + here * np.uint16(middle[j])


@njit(**EXACT_ROW)
def _sum_row(line: Any, taps: Any, smooth: UInt8) -> None:
    far, near, here = taps
    for j in range(smooth.size):
        outer, inner = line[j] + line[j + 4], line[j + 1] + line[j + 3]
        total = np.uint16(far * outer + near * inner + here * line[j + 2] + np.uint16(128))
        smooth[j] = total >> np.uint16(8)


@njit(**PART)
def _smooth_rows(image: UInt8, taps: Any, smooth: UInt8, start: int, stride: int) -> None:
    rows, columns = image.shape
    line = np.empty(columns + 4, np.uint16)
    for i in range(rows):
        _sum_rows(
            image[reflected(i - 2, rows)],
            image[reflected(i - 1, rows)],
            image[i],
            image[reflected(i + 1, rows)],
            image[reflected(i + 2, rows)],
            taps,
            line,
        )
        for place in (-2, -1, columns, columns + 1):
            line[place + 2] = line[reflected(place, columns) + 2]
        at = start + i * stride
        _sum_row(line, taps, smooth[at : at + columns])


@njit(**PART)
def _typical_of(flat: UInt8, start: int, stride: int, shape: Any, step: int) -> int:
    counts = np.zeros(_FULL + 1, np.int64)
    for i in range(0, shape[0], step):
        for j in range(0, shape[1], step):
            counts[flat[start + i * stride + j]] += 1
    total = 0
    for peak in range(_FULL + 1):
        total += counts[peak] * peak * peak
    typical = below = 0
    while 2 * below < total:
        typical += 1
        below += counts[typical] * typical * typical
    return typical


@njit(**EXACT_ROW)
def _spot_row(
    thick: UInt8,
    smooth: UInt8,
    around: UInt8,
    limits: Any,
    dark: UInt8,
    weight: UInt8,
    peaks: UInt8,
) -> None:
    marker, background, least = limits
    for j in range(dark.size):
        peaks[j] = around[j]
        peak = np.float32(peaks[j])
        contrast = np.float32(thick[j])
        dark[j] = contrast > max(np.rint(peak * marker), least)
        counted = np.float32(smooth[j]) - np.rint(peak * background)
        weight[j] = np.uint8(max(counted, np.float32(0)))


@njit(**LOOP)
def spot_pixels(
    contrast: UInt8, taps: Any, opening: int, reach: int, shares: Any, darkest: float, step: int
) -> tuple[Any, Any, Any, float]:
    """Find the pixels of dark spots.

    Parameters
    ----------
    contrast : (h, w) uint8
    taps : (int, int, int)
        Weights of smoothing, in sixteenths: two pixels away, one pixel away, and of the pixel.
    opening, reach : int
        Reach of the opening and of the neighbourhood to either side, px.
    shares : (float, float, float)
        See :class:`tactile_core.algorithms.markers.parameters.DetectionParameters`:
        ``marker_share``, ``background_share`` and ``min_contrast``.
    darkest : float
        Lower bound of the typical contrast.
    step : int
        Every how many pixels the typical contrast is sampled.

    Returns
    -------
    dark : (h, w) uint8
        1 on spots.
    weight : (h, w) uint8
        Contrast that is counted.
    peaks : (h, w) uint8
        Maximum contrast in the neighbourhood.
    level : float
        Typical contrast.
    """
    rows, columns = contrast.shape
    # a row begins as far from the one before as the opening and the neighbourhood spread
    gap = opening + reach
    stride = columns + gap
    start = gap * stride + gap
    size = start + (rows + gap) * stride
    weights = np.uint16(taps[0]), np.uint16(taps[1]), np.uint16(taps[2])
    smooth, spare = np.empty(size, np.uint8), np.empty(size, np.uint8)
    flat = np.zeros(size, np.uint8)
    _smooth_rows(contrast, weights, smooth, start, stride)
    # an erosion is a dilation of the inverse, in which nothing beyond the image counts
    for i in range(rows):
        at = start + i * stride
        invert_row(smooth[at:], flat[at : at + columns])
    eroded, spare = dilated(flat, spare, opening, stride)
    thick = np.zeros(size, np.uint8)
    of_thick = start - opening * (stride + 1)
    for i in range(rows):
        at = start + i * stride
        invert_row(eroded[of_thick + i * stride :], thick[at : at + columns])
    thick, spare = dilated(thick, spare, opening, stride)
    copy_row(thick, eroded)
    around, _ = dilated(eroded, spare, reach, stride)
    of_around = of_thick - reach * (stride + 1)
    level = max(float(_typical_of(around, of_around, stride, (rows, columns), step)), darkest)
    limits = np.float32(shares[0]), np.float32(shares[1]), np.float32(shares[2] * level)
    dark, weight = np.empty((rows, columns), np.uint8), np.empty((rows, columns), np.uint8)
    peaks = np.empty((rows, columns), np.uint8)
    for i in range(rows):
        _spot_row(
            thick[of_thick + i * stride :],
            smooth[start + i * stride :],
            around[of_around + i * stride :],
            limits,
            dark[i],
            weight[i],
            peaks[i],
        )
    return dark, weight, peaks, level
