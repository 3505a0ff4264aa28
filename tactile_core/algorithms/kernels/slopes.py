"""Kernels of :mod:`tactile_core.algorithms.slope_field` and ``sampling``.

Bytes are divided in exact arithmetic, so that they round as in OpenCV.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32, UInt8
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, ROW


@njit(**EXACT_ROW)
def _entries(
    smoothed: UInt8, base: UInt8, per_unit: Any, first: Any, last: Any, entries: UInt8
) -> None:
    for j in range(entries.size):
        ratio = np.rint(np.float32(smoothed[j]) * per_unit / np.float32(base[j]))
        # a ratio saturates as a byte before the first entry is subtracted
        entry = min(ratio, np.float32(255)) - first
        entries[j] = np.uint8(np.int32(min(max(entry, np.float32(0)), last)))


@njit(**EXACT_ROW)
def _places(entries: UInt8, count: Any, places: Any) -> None:
    for j in range(places.size):
        first, second = np.uint32(entries[3 * j]), np.uint32(entries[3 * j + 1])
        places[j] = (first * count + second) * count + np.uint32(entries[3 * j + 2])


@njit(**EXACT_ROW)
def _looked_up(places: Any, table: Any, found: Any) -> None:
    for j in range(places.size):
        found[j] = table[places[j]]


@njit(**EXACT_ROW)
def _split(pairs: Float32, nx: Float32, ny: Float32) -> None:
    for j in range(nx.size):
        nx[j] = pairs[2 * j]
        ny[j] = pairs[2 * j + 1]


@njit(**EXACT_ROW)
def _bare_row(upper: UInt8, lower: UInt8, hidden: UInt8, below: UInt8, sums: Any) -> None:
    for j in range(hidden.size // 2):
        a, b = np.uint16(1) - hidden[2 * j], np.uint16(1) - hidden[2 * j + 1]
        c, d = np.uint16(1) - below[2 * j], np.uint16(1) - below[2 * j + 1]
        k = 6 * j
        sums[0, j] = a + b + c + d
        sums[1, j] = a * upper[k] + b * upper[k + 3] + c * lower[k] + d * lower[k + 3]
        sums[2, j] = a * upper[k + 1] + b * upper[k + 4] + c * lower[k + 1] + d * lower[k + 4]
        sums[3, j] = a * upper[k + 2] + b * upper[k + 5] + c * lower[k + 2] + d * lower[k + 5]


@njit(**EXACT_ROW)
def _bare_mean(sums: Any, share: UInt8, small: UInt8) -> None:
    for j in range(share.size):
        bare = (sums[0, j] * np.uint16(255) + np.uint16(2)) // np.uint16(4)
        share[j] = bare
        most = np.float32(max(bare, np.uint16(1)))
        for k in range(3):
            mean = np.float32((sums[k + 1, j] + np.uint16(2)) // np.uint16(4))
            whole = np.rint(mean * np.float32(255) / most)
            small[3 * j + k] = np.uint8(min(whole, np.float32(255)))


@njit(**LOOP)
def halved_where_bare(pixels: UInt8, hidden: UInt8, share: UInt8, small: UInt8) -> None:
    """Halve an image, averaging each cell over the pixels that no marker hides.

    Parameters
    ----------
    pixels : (2 h, 6 w) uint8
        Interleaved channels.
    hidden : (2 h, 2 w) uint8
        1 where a marker hides the gel surface.
    share : (h, w) uint8
        Overwritten by the share of each cell that is bare, 255 for all of it.
    small : (h, 3 w) uint8
        Overwritten by the means; 0 where all is hidden.
    """
    sums = np.empty((4, share.shape[1]), np.uint16)
    for i in range(len(share)):
        _bare_row(pixels[2 * i], pixels[2 * i + 1], hidden[2 * i], hidden[2 * i + 1], sums)
        _bare_mean(sums, share[i], small[i])


@njit(**ROW)
def _corrected_row(
    nx: Float32, ny: Float32, above: Float32, below: Float32, share: Any, steepest: Any
) -> None:
    bound = steepest * steepest
    for j in range(nx.size):
        x = nx[j] + above[0, j] + share * (below[0, j] - above[0, j])
        y = ny[j] + above[1, j] + share * (below[1, j] - above[1, j])
        square = x * x + y * y
        excess = max(square, bound) / bound
        per_cosine = 1 / np.sqrt(excess * (np.float32(1) - min(square, bound)))
        nx[j] = x * per_cosine
        ny[j] = y * per_cosine


@njit(**LOOP)
def corrected_slopes(nx: Float32, ny: Float32, missing: Float32, steepest: float) -> None:
    """Add a correction, interpolated linearly between rows, and convert normals to slopes.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Components of unit normals; overwritten by the slopes.
    missing : (2, h, W) float32
        Their corrections, at the centres of h bands that tile the rows.
    steepest : float
        Longer ``normal_xy`` are shortened to it.
    """
    count = missing.shape[1]
    for i in range(len(nx)):
        at = min(max((i + 0.5) * count / len(nx) - 0.5, 0.0), float(count - 1))
        upper = int(at)
        above, below = missing[:, upper], missing[:, min(upper + 1, count - 1)]
        _corrected_row(nx[i], ny[i], above, below, np.float32(at - upper), np.float32(steepest))


@njit(**ROW)
def _add(row: Any, total: Any) -> None:
    for j in range(total.size):
        total[j] += row[j]


@njit(**LOOP)
def _block_means(total: Any, channels: int, rows: int, means: Any) -> None:
    count = total.size // means.size
    for j in range(means.size // channels):
        for k in range(channels):
            block = np.float32(0)
            for i in range(count):
                block += total[(j * count + i) * channels + k]
            means[j * channels + k] = block / np.float32(count * rows)


@njit(**LOOP)
def normal_xy_of_bytes(
    smoothed: UInt8,
    base: UInt8,
    table: Any,
    axis: tuple[float, int, int],
    nx: Float32,
    ny: Float32,
    colours: Float32,
    normals: Float32,
) -> None:
    """Look up ``normal_xy`` of each pixel in the table, and average it and the colours over blocks.

    Parameters
    ----------
    smoothed, base : (H, 3 W) uint8
        Interleaved channels of frame and reference; ``base`` is nowhere 0.
    table : (B³,) int64
        Pairs of float32 components, copied as one integer; the last channel is the fastest axis.
    axis : (per_unit, first, count)
        As in :class:`~tactile_core.algorithms.colour_table.Axis`.
    nx, ny : (H, W) float32
        Overwritten.
    colours : (h, 3 w) float32
        Overwritten by the interleaved mean of ``smoothed`` over each of the blocks that tile it.
    normals : (2, h, w) float32
        Overwritten by the mean of ``nx`` and ``ny`` over each block.
    """
    columns = nx.shape[1]
    rows = len(nx) // len(colours)
    colour = np.zeros(3 * columns, np.float32)
    total_x, total_y = np.zeros((2, columns), np.float32)
    per_unit, first, last = np.float32(axis[0]), np.float32(axis[1]), np.float32(axis[2] - 1)
    entries = np.empty(3 * columns, np.uint8)
    places = np.empty(columns, np.uint32)
    found = np.empty(columns, np.int64)
    # four short loops over a row, three of them vectorised, take half the time of one loop
    for i in range(len(nx)):
        _entries(smoothed[i], base[i], per_unit, first, last, entries)
        _places(entries, np.uint32(axis[2]), places)
        _looked_up(places, table, found)
        _split(found.view(np.float32), nx[i], ny[i])
        _add(smoothed[i], colour)
        _add(nx[i], total_x)
        _add(ny[i], total_y)
        if (i + 1) % rows == 0:
            block = i // rows
            _block_means(colour, 3, rows, colours[block])
            _block_means(total_x, 1, rows, normals[0, block])
            _block_means(total_y, 1, rows, normals[1, block])
            colour[:] = total_x[:] = total_y[:] = 0
