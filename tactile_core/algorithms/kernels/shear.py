"""Kernels of the shear of a contact: its motion since an earlier frame, and the rigid part of it.

Fields are (h, w) complex64, x + iy.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.edges import reflected
from tactile_core.algorithms.kernels.options import LOOP, PART, ROW
from tactile_core.algorithms.kernels.selection import quantile_of


@njit(**PART)
def _length(displacement: Any) -> Any:
    x, y = np.float64(displacement.real), np.float64(displacement.imag)
    return np.float32(np.sqrt(x * x + y * y))


@njit(**PART)
def _sampled(field: Any, x: Any, y: Any) -> tuple[Any, Any]:
    """Interpolate as OpenCV does, with places rounded to 1/32 and the border repeated outwards."""
    rows, columns = field.shape
    column, row = int(np.rint(x * np.float32(32))), int(np.rint(y * np.float32(32)))
    right, down = np.float32(column & 31) / np.float32(32), np.float32(row & 31) / np.float32(32)
    j, i = min(max(column >> 5, 0), columns - 1), min(max(row >> 5, 0), rows - 1)
    k, low = min(max((column >> 5) + 1, 0), columns - 1), min(max((row >> 5) + 1, 0), rows - 1)
    left, up = np.float32(1) - right, np.float32(1) - down
    a, b, c, d = up * left, up * right, down * left, down * right
    one, two, three, four = field[i, j], field[i, k], field[low, j], field[low, k]
    return (
        one.real * a + two.real * b + three.real * c + four.real * d,
        one.imag * a + two.imag * b + three.imag * c + four.imag * d,
    )


@njit(**PART)
def _since(now: Any, before: Any, i: int, j: int, per_mm: Any, iterations: int) -> Any:
    """Displacement of the surface at a grid point since an earlier field, as ``plane.since``."""
    x, y = now[i, j].real - before[i, j].real, now[i, j].imag - before[i, j].imag
    for _ in range(iterations):
        was_x, was_y = _sampled(before, np.float32(j) - x * per_mm, np.float32(i) - y * per_mm)
        x, y = now[i, j].real - was_x, now[i, j].imag - was_y
    return np.complex64(complex(x, y))


@njit(**PART)
def _since_in(now: Any, before: Any, mask: Any, per_mm: Any, iterations: int, moved: Any) -> None:
    """Write the displacement in a mask and at the grid points next to it."""
    rows, columns = mask.shape
    first, last = np.full(rows + 2, columns), np.full(rows + 2, -1)
    for i in range(rows):
        for j in range(columns):
            if mask[i, j]:
                first[i + 1], last[i + 1] = min(first[i + 1], j), j
    for i in range(rows):
        low, high = (
            min(first[i], first[i + 1], first[i + 2]),
            max(last[i], last[i + 1], last[i + 2]),
        )
        for j in range(max(low - 1, 0), min(high + 2, columns)):
            moved[i, j] = _since(now, before, i, j, per_mm, iterations)


@njit(**PART)
def _times_far(moved: Any, power: int, weight: Any) -> None:
    """Multiply weights by those that favour large displacements: ``stick_region.far_weights``."""
    size, most = np.empty(len(moved), np.float32), np.float32(1e-9)
    for k in range(len(moved)):
        size[k] = _length(moved[k])
        most = max(most, size[k])
    for k in range(len(moved)):
        share, far = size[k] / most, np.float32(1)
        for _ in range(power):
            far *= share
        weight[k] *= far + np.float32(1e-6)


@njit(**PART)
def _strain(moved: Any, i: int, j: int, scale: Any) -> Any:
    """Norm of the strain tensor at a grid point, with slopes smoothed as by Sobel's operator."""
    height, width = moved.shape
    above, row, below = moved[reflected(i - 1, height)], moved[i], moved[reflected(i + 1, height)]
    left, right = reflected(j - 1, width), reflected(j + 1, width)
    two = np.float32(2)
    along = above[right] - above[left] + two * (row[right] - row[left]) + below[right] - below[left]
    down = below[left] - above[left] + two * (below[j] - above[j]) + below[right] - above[right]
    xx, yy, shear = along.real, down.imag, along.imag + down.real
    return scale * np.sqrt(xx * xx + yy * yy + np.float32(0.5) * shear * shear)


@njit(**PART)
def _entropy(moved: Any, mask: Any, bin_mm: Any) -> float:
    """Entropy of the length of the displacement in a mask, in bits."""
    bins, found, most = np.empty(mask.size, np.int64), 0, 0
    for i in range(len(mask)):
        for j in range(mask.shape[1]):
            if mask[i, j]:
                bins[found] = int(_length(moved[i, j]) / bin_mm)
                most = max(most, bins[found])
                found += 1
    counts, total = np.zeros(most + 1, np.int64), 0.0
    for k in range(found):
        counts[bins[k]] += 1
    for count in counts:
        if count:
            total -= count / found * np.log2(count / found)
    return max(total, 0.0)


@njit(**ROW)
def _weighted(
    x: Any, y: Any, moved_x: Any, moved_y: Any, weight: Any
) -> tuple[Any, Any, Any, Any, Any, Any, Any]:
    total = at_x = at_y = to_x = to_y = square = torque = 0.0
    for k in range(weight.size):
        w = weight[k]
        total += w
        at_x += w * x[k]
        at_y += w * y[k]
        to_x += w * moved_x[k]
        to_y += w * moved_y[k]
        square += w * (x[k] * x[k] + y[k] * y[k])
        torque += w * (x[k] * moved_y[k] - y[k] * moved_x[k])
    return total, at_x, at_y, to_x, to_y, square, torque


@njit(**PART)
def _rigid(sums: Any, max_sine: float) -> tuple[float, float, float, float]:
    """Shift of the centroid, x and y, and displacement per mm of distance from it, x and y."""
    total = sums[0]
    x, y, to_x, to_y = sums[1] / total, sums[2] / total, sums[3] / total, sums[4] / total
    spread = max(sums[5] / total - x * x - y * y, 1e-12)
    sine = (sums[6] / total - (x * to_y - y * to_x)) / spread
    sine = min(max(sine, -max_sine), max_sine)
    cosine = 1 - np.sqrt(1 - sine * sine)
    return to_x - (cosine * x - sine * y), to_y - (cosine * y + sine * x), cosine, sine


@njit(**ROW)
def _lags(
    x: Any, y: Any, moved_x: Any, moved_y: Any, motion: tuple[Any, Any, Any, Any], lag: Any
) -> None:
    shift_x, shift_y, cosine, sine = motion
    for k in range(x.size):
        apart_x = moved_x[k] - (shift_x + cosine * x[k] - sine * y[k])
        apart_y = moved_y[k] - (shift_y + cosine * y[k] + sine * x[k])
        lag[k] = np.sqrt(apart_x * apart_x + apart_y * apart_y)


@njit(**ROW)
def _reweighted(lag: Any, scale: Any, weight: Any) -> None:
    for k in range(lag.size):
        relative = lag[k] / scale
        root = 1 + relative * relative
        weight[k] = 1 / (root * root)


@njit(**PART)
def _rms(motion: tuple[float, float, float, float], square: float) -> Any:
    shift_x, shift_y, cosine, sine = motion
    return np.sqrt(shift_x**2 + shift_y**2 + (cosine**2 + sine**2) * square)


@njit(**PART)
def _fit(
    places: tuple[Any, Any, Any, Any], fit: tuple[float, float, int, float], lag: Any, weight: Any
) -> Any:
    """Do what :func:`fitted_motion` does, with x and y in arrays (n,) float64 of their own."""
    x, y, moved_x, moved_y = places
    noise_mm, lag_tolerance, rounds, max_sine = fit
    x -= x.mean()
    y -= y.mean()
    whole = _weighted(x, y, moved_x, moved_y, np.ones(x.size, np.float32))
    square = whole[5] / x.size
    motion, rms_mm = (0.0, 0.0, 0.0, 0.0), 0.0
    for _ in range(rounds):
        motion = _rigid(_weighted(x, y, moved_x, moved_y, weight), max_sine)
        _lags(x, y, moved_x, moved_y, motion, lag)
        rms_mm = _rms(motion, square)
        _reweighted(lag, max(lag_tolerance * rms_mm, noise_mm), weight)
    turned = (0.0, 0.0, motion[2], motion[3])
    sheared_mm = _rms(_rigid(whole, max_sine), square)
    return motion[0], motion[1], motion[3], rms_mm, _rms(turned, square), sheared_mm


@njit(**LOOP)
def fitted_motion(
    moved: Any, position: Any, fit: tuple[float, float, int, float], lag: Any, weight: Any
) -> Any:
    """Fit the rigid motion of the stick region; see ``stick_region.stick_region``.

    Parameters
    ----------
    moved, position : (n,) complex64
    fit : (float, float, int, float)
        ``noise_mm`` and ``lag_tolerance``; and ``rounds`` and ``max_sine`` of ``STICK_REGION``.
    lag : (n,) float32
        Overwritten by the distance of each displacement from the rigid motion.
    weight : (n,) float32
        The initial weights; overwritten by the last ones.

    Returns
    -------
    tuple of float
        Shift, x and y; sine of the rotation; and RMS of the motion, of its rotation, and of a
        motion fitted to all points.
    """
    # unpacked, an array loses the knowledge that its rows are contiguous
    places = np.empty((4, moved.size))
    x, y, moved_x, moved_y = places[0], places[1], places[2], places[3]
    for k in range(moved.size):
        x[k], y[k] = position[k].real, position[k].imag
        moved_x[k], moved_y[k] = moved[k].real, moved[k].imag
    return _fit((x, y, moved_x, moved_y), fit, lag, weight)


@njit(**LOOP)
def moved_contact(
    now: Any,
    before: Any,
    mask: Any,
    every: int,
    grid: tuple[float, int],
    calm: tuple[float, float, float, int],
    fit: tuple[float, float, int, float],
    bin_mm: Any,
) -> tuple[tuple[Any, Any, Any, float], Any, Any, tuple[Any, ...]]:
    """Motion of the points of a contact, its entropy, and the rigid motion of those that stick.

    Parameters
    ----------
    now, before : (h, w) complex64
        Displacement fields.
    mask : (h, w) bool
        The contact.
    every : int
        Distance of the points in the list of all points of the contact, row by row.
    grid : (float, int)
        Distance of grid points in mm, and ``iterations`` of ``PLANE``.
    calm : (float, float, float, int)
        ``calm_quantile``, ``calm_strains``, ``min_strain`` and ``distance_power`` of
        ``STICK_REGION``.
    fit : (float, float, int, float)
        See :func:`fitted_motion`.
    bin_mm : float32
        Width of a bin of the entropy.

    Returns
    -------
    motion : tuple
        Flat indices of the points, (n,) int64; their displacement, (n,) complex64; their weights,
        (n,) float32, of :func:`tactile_core.algorithms.slip.stick_region.calm_weights`; and the
        entropy in bits.
    lag : (n,) float32
    weight : (n,) float32
        See :func:`fitted_motion`.
    rigid : tuple of float
        What :func:`fitted_motion` returns.
    """
    rows, columns = mask.shape
    per_mm, moved = np.float32(1 / grid[0]), np.empty(now.shape, np.complex64)
    _since_in(now, before, mask, per_mm, grid[1], moved)
    most, skipped, k = mask.size // every + 1, every - 1, 0
    points, displacement = np.empty(most, np.int64), np.empty(most, np.complex64)
    strains, places = np.empty(most, np.float32), np.empty((4, most))
    for i in range(rows):
        for j in range(columns):
            if not mask[i, j]:
                continue
            skipped += 1
            if skipped < every:
                continue
            skipped, points[k], displacement[k] = 0, i * columns + j, moved[i, j]
            places[0, k], places[1, k] = grid[0] * j, grid[0] * i
            places[2, k], places[3, k] = moved[i, j].real, moved[i, j].imag
            strains[k] = _strain(moved, i, j, np.float32(0.125) * per_mm)
            k += 1
    count = k
    points, displacement, strains = points[:k].copy(), displacement[:k].copy(), strains[:k]
    weights = np.empty(count, np.float32)
    typical = calm[1] * max(quantile_of(strains, calm[0]), calm[2])
    for k in range(count):
        weights[k] = np.exp(-((strains[k] / typical) ** 2))
    _times_far(displacement, calm[3], weights)
    lag, weight = np.empty(count, np.float32), weights.copy()
    x, y, moved_x, moved_y = places[0], places[1], places[2], places[3]
    rigid = _fit((x[:count], y[:count], moved_x[:count], moved_y[:count]), fit, lag, weight)
    motion = points, displacement, weights, _entropy(moved, mask, bin_mm)
    return motion, lag, weight, rigid


@njit(**LOOP)
def moved_points(
    now: Any, before: Any, points: Any, grid: tuple[float, int], power: int, weights: Any
) -> Any:
    """Return the motion (n,) of points, and multiply their weights by ``far_weights``.

    Parameters
    ----------
    now, before, grid
        See :func:`moved_contact`.
    points : (n,) int64
        Flat indices.
    power : int
        ``distance_power`` of ``STICK_REGION``.
    weights : (n,) float32
    """
    columns, per_mm = now.shape[1], np.float32(1 / grid[0])
    moved = np.empty(points.size, np.complex64)
    for k in range(points.size):
        i, j = points[k] // columns, points[k] % columns
        moved[k] = _since(now, before, i, j, per_mm, grid[1])
    _times_far(moved, power, weights)
    return moved


@njit(**LOOP)
def recent_span(
    now: Any,
    before: Any,
    newest: int,
    kept: int,
    points: Any,
    limits: tuple[float, float, float],
) -> tuple[int, float]:
    """Number of frames in which points moved by a distance, and how far they moved.

    Parameters
    ----------
    now : (h, w) complex64
    before : (frames, h, w) complex64
        Earlier fields, in a ring.
    newest, kept : int
        Where the last of them is, and how many there are, at least one.
    points : (n,) int64
        Flat indices.
    limits : (float, float, float)
        See :class:`tactile_core.algorithms.slip.recent_fields.RecentFields`.

    Returns
    -------
    span : int
    moved_mm : float
    """
    share, enough_mm, rest_mm = limits
    now, change, moved_mm = now.reshape(-1), np.empty(points.size, np.float32), 0.0
    for span in range(1, kept + 1):
        earlier = before[(newest + 1 - span) % len(before)].reshape(-1)
        for k in range(points.size):
            change[k] = _length(now[points[k]] - earlier[points[k]])
        longer_mm = quantile_of(change, share)
        if span > 1 and longer_mm < moved_mm + rest_mm:
            return span - 1, moved_mm
        moved_mm = longer_mm
        if moved_mm >= enough_mm:
            return span, moved_mm
    return kept, moved_mm
