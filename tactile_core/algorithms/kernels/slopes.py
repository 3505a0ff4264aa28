"""Kernels of :mod:`tactile_core.algorithms.slope_field` and ``sampling``.

Bytes are divided in exact arithmetic, so that they round as in OpenCV.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32, UInt8
from tactile_core.algorithms.kernels.edges import reflected
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import add_row, copy_row, set_row, sum_of_two


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


# The compiler checks at run time that no two arrays overlap, and only vectorises a loop if this
# takes few checks. So a loop has few arrays.


@njit(**EXACT_ROW)
def _bare_share(hidden: UInt8, below: UInt8, share: UInt8) -> None:
    for j in range(share.size):
        count = hidden[2 * j] + hidden[2 * j + 1] + below[2 * j] + below[2 * j + 1]
        share[j] = ((np.uint16(4) - np.uint16(count)) * np.uint16(255) + np.uint16(2)) // np.uint16(
            4
        )


@njit(inline="always")
def _sum(a: Any, b: Any, c: Any, d: Any) -> Any:
    return np.uint16(a) + np.uint16(b) + np.uint16(c) + np.uint16(d)


@njit(**EXACT_ROW)
def _bare_sums(upper: UInt8, lower: UInt8, hidden: UInt8, below: UInt8, sums: Any) -> None:
    for j in range(hidden.size // 2):
        # all bits of a bare pixel, and none of a hidden one
        a, b = np.uint8(hidden[2 * j] - 1), np.uint8(hidden[2 * j + 1] - 1)
        c, d = np.uint8(below[2 * j] - 1), np.uint8(below[2 * j + 1] - 1)
        k = 6 * j
        sums[3 * j] = _sum(upper[k] & a, upper[k + 3] & b, lower[k] & c, lower[k + 3] & d)
        k += 1
        sums[3 * j + 1] = _sum(upper[k] & a, upper[k + 3] & b, lower[k] & c, lower[k + 3] & d)
        k += 1
        sums[3 * j + 2] = _sum(upper[k] & a, upper[k + 3] & b, lower[k] & c, lower[k + 3] & d)


@njit(inline="always")
def _of_bare(total: Any, bare: Any) -> Any:
    quarter = np.float32((total + np.uint16(2)) // np.uint16(4))
    return np.uint8(np.int32(np.rint(quarter * np.float32(255) / bare)))


@njit(**EXACT_ROW)
def _bare_means(sums: Any, share: UInt8, least: Any, small: UInt8) -> None:
    for j in range(share.size):
        # the mean of a cell that is mostly hidden rounds to 0
        bare = np.float32(share[j]) if share[j] >= least else np.float32(np.inf)
        small[3 * j] = _of_bare(sums[3 * j], bare)
        small[3 * j + 1] = _of_bare(sums[3 * j + 1], bare)
        small[3 * j + 2] = _of_bare(sums[3 * j + 2], bare)


@njit(**LOOP)
def halved_where_bare(pixels: UInt8, hidden: UInt8, least: int, share: UInt8, small: UInt8) -> None:
    """Halve an image, averaging each cell over the pixels that no marker hides.

    Parameters
    ----------
    pixels : (2 h, 6 w) uint8
        Interleaved channels.
    hidden : (2 h, 2 w) uint8
        1 where a marker hides the gel surface.
    least : int
        Share from which a cell counts as bare, of 255.
    share : (h, w) uint8
        Overwritten by the share of each cell that is bare, 255 for all of it.
    small : (h, 3 w) uint8
        Overwritten by the means; 0 in cells that are not bare.
    """
    sums = np.empty(small.shape[1], np.uint16)
    for i in range(len(share)):
        upper, lower = 2 * i, 2 * i + 1
        _bare_share(hidden[upper], hidden[lower], share[i])
        _bare_sums(pixels[upper], pixels[lower], hidden[upper], hidden[lower], sums)
        _bare_means(sums, share[i], np.uint8(least), small[i])


@njit(**ROW)
def _between(above: Float32, below: Float32, share: Any, out: Float32) -> None:
    for j in range(out.size):
        out[j] = above[j] + share * (below[j] - above[j])


@njit(**ROW)
def _corrected(nx: Float32, ny: Float32, correction: Float32, bound: Any) -> None:
    for j in range(nx.size):
        x, y = nx[j] + correction[j], ny[j] + correction[nx.size + j]
        square = x * x + y * y
        excess = max(square, bound) / bound
        scale = np.float32(1) / np.sqrt(excess * (np.float32(1) - min(square, bound)))
        nx[j] = x * scale
        ny[j] = y * scale


@njit(**PART)
def _widened(missing: Float32, columns: int, out: Float32) -> None:
    """Interpolate (2, h, w) linearly to ``columns``, into (h, 2 columns) with both side by side."""
    count = missing.shape[2]
    for j in range(columns):
        at = min(max((j + 0.5) * count / columns - 0.5, 0.0), float(count - 1))
        left = int(at)
        right, share = min(left + 1, count - 1), np.float32(at - left)
        for k in range(2):
            for i in range(missing.shape[1]):
                value = missing[k, i, left]
                out[i, k * columns + j] = value + share * (missing[k, i, right] - value)


@njit(**LOOP)
def corrected_slopes(nx: Float32, ny: Float32, missing: Float32, steepest: float) -> None:
    """Add a correction, interpolated linearly, and convert normals to slopes.

    Parameters
    ----------
    nx, ny : (H, W) float32
        Components of unit normals; overwritten by the slopes.
    missing : (2, h, w) float32
        Their corrections at the centres of h · w cells that tile the image.
    steepest : float
        Longer ``normal_xy`` are shortened to it.
    """
    rows, columns = nx.shape
    count = missing.shape[1]
    bands = np.empty((count, 2 * columns), np.float32)
    _widened(missing, columns, bands)
    correction = np.empty(2 * columns, np.float32)
    bound = np.float32(steepest * steepest)
    for i in range(rows):
        at = min(max((i + 0.5) * count / rows - 0.5, 0.0), float(count - 1))
        upper = int(at)
        lower = min(upper + 1, count - 1)
        _between(bands[upper], bands[lower], np.float32(at - upper), correction)
        _corrected(nx[i], ny[i], correction, bound)


@njit(**LOOP)
def extrapolated(
    colours: Float32,
    base: Float32,
    still: Float32,
    response: Float32,
    small: float,
    found: Float32,
    changed: Any,
    changes: Float32,
) -> int:
    """Extrapolate a model from the reference, and list where the light has changed too much for it.

    Parameters
    ----------
    colours, base : (N, 3) float32
        Of frame and reference; ``base`` is nowhere 0.
    still : (2, N) float32
        The model's components of the normal at the reference.
    response : (2, N, 3) float32
        Their derivatives by the relative change of each channel.
    small : float
        Largest relative change that counts as small.
    found : (2, N) float32
        Overwritten by the extrapolated components.
    changed : (N,) int64
        Its beginning is overwritten by the places of larger changes.
    changes : (N, 3) float32
        Its beginning is overwritten by these changes.

    Returns
    -------
    int
        Number of these places.
    """
    count, one, most = 0, np.float32(1), np.float32(small)
    for n in range(len(colours)):
        a = colours[n, 0] / base[n, 0] - one
        b = colours[n, 1] / base[n, 1] - one
        c = colours[n, 2] / base[n, 2] - one
        for k in range(2):
            slopes = response[k, n]
            found[k, n] = still[k, n] + (slopes[0] * a + slopes[1] * b + slopes[2] * c)
        if max(abs(a), abs(b), abs(c)) > most:
            changed[count] = n
            changes[count, 0], changes[count, 1], changes[count, 2] = a, b, c
            count += 1
    return count


@njit(**EXACT_ROW)
def _add_counts(row: Any, sums: Any) -> None:
    for j in range(row.size):
        sums[j] += np.uint16(row[j])


@njit(**EXACT_ROW)
def _slide_counts(new: UInt8, old: UInt8, sums: Any) -> None:
    for j in range(new.size):
        sums[j] += np.uint16(np.uint16(new[j]) - np.uint16(old[j]))


@njit(**PART)
def _box_sums(sums: Any, channels: int, reach: int, spare: tuple[Any, Any], out: Any) -> None:
    """Sum 2 reach + 1 pixels around each along a row.

    Sums of 1, 2, 4 … pixels are each made of two of the former, and joined.
    """
    count, width = sums.size // channels, 2 * reach + 1
    values, wider = spare
    copy_row(sums, values[reach * channels :])
    for i in range(reach):
        left, right = reflected(i - reach, count), reflected(count + i, count)
        for k in range(channels):
            values[i * channels + k] = sums[left * channels + k]
            values[(reach + count + i) * channels + k] = sums[right * channels + k]
    set_row(out, np.uint16(0))
    wide, joined = 1, 0
    while True:
        if width & wide:
            _add_counts(values[joined * channels : joined * channels + out.size], out)
            joined += wide
        wide *= 2
        if wide > width:
            break
        kept = (count + 2 * reach - wide + 1) * channels
        sum_of_two(values, values[wide // 2 * channels :], wider[:kept])
        values, wider = wider, values


@njit(**EXACT_ROW)
def _thrice(number: Any, bare: UInt8, numbers: Any, hidden: UInt8) -> None:
    for j in range(number.size):
        numbers[3 * j] = numbers[3 * j + 1] = numbers[3 * j + 2] = max(number[j], np.uint16(1))
        # all bits of a hidden pixel, and none of a bare one
        hidden[3 * j] = hidden[3 * j + 1] = hidden[3 * j + 2] = np.uint8(bare[j] - 1)


@njit(**EXACT_ROW)
def _fill_row(pixels: UInt8, total: Any, numbers: Any, hidden: UInt8, filled: UInt8) -> None:
    for k in range(filled.size):
        mean = np.rint(np.float32(total[k]) / np.float32(numbers[k]))
        filled[k] = pixels[k] | (np.uint8(np.int32(mean)) & hidden[k])


@njit(**LOOP)
def filled_where_hidden(pixels: UInt8, bare: UInt8, reach: int, filled: UInt8) -> None:
    """Fill hidden pixels by the mean of the bare ones in the square around them.

    Parameters
    ----------
    pixels : (h, 3 w) uint8
        Interleaved channels; 0 where hidden.
    bare : (h, w) uint8
        1 where no marker hides the surface, else 0.
    reach : int
        The square has 2 reach + 1 ≤ 15 pixels across and down, so that sums need 16 bits.
    filled : (h, 3 w) uint8
        Overwritten; 0 where no pixel around is bare.
    """
    rows, columns = bare.shape
    sums, counts = np.zeros(3 * columns, np.uint16), np.zeros(columns, np.uint16)
    total, number = np.empty(3 * columns, np.uint16), np.empty(columns, np.uint16)
    numbers, hidden = np.empty(3 * columns, np.uint16), np.empty(3 * columns, np.uint8)
    most = 3 * (columns + 2 * reach)
    spare = np.empty(most, np.uint16), np.empty(most, np.uint16)
    for i in range(-reach, reach + 1):
        _add_counts(pixels[reflected(i, rows)], sums)
        _add_counts(bare[reflected(i, rows)], counts)
    for i in range(rows):
        if i:
            new, old = reflected(i + reach, rows), reflected(i - 1 - reach, rows)
            _slide_counts(pixels[new], pixels[old], sums)
            _slide_counts(bare[new], bare[old], counts)
        _box_sums(sums, 3, reach, spare, total)
        _box_sums(counts, 1, reach, spare, number)
        _thrice(number, bare[i], numbers, hidden)
        _fill_row(pixels[i], total, numbers, hidden, filled[i])


@njit(**PART)
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
    total_x, total_y = np.zeros(columns, np.float32), np.zeros(columns, np.float32)
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
        add_row(smoothed[i], colour)
        add_row(nx[i], total_x)
        add_row(ny[i], total_y)
        if (i + 1) % rows == 0:
            block = i // rows
            _block_means(colour, 3, rows, colours[block])
            _block_means(total_x, 1, rows, normals[0, block])
            _block_means(total_y, 1, rows, normals[1, block])
            set_row(colour, np.float32(0))
            set_row(total_x, np.float32(0))
            set_row(total_y, np.float32(0))
