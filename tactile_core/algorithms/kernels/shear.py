"""Kernels of the shear of a contact: its motion since an earlier frame, and the rigid part of it.

Fields are (h, w, 2) float32, x and y.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART, ROW
from tactile_core.algorithms.kernels.selection import quantile_of


@njit(**PART)
def _length(x: Any, y: Any) -> Any:
    x, y = np.float64(x), np.float64(y)
    return np.float32(np.sqrt(x * x + y * y))


@njit(**PART)
def _write_far(moved: Any, power: int, out: Any) -> None:
    """Weights that favour large displacements, as ``stick_region.far_weights``."""
    most = np.float32(1e-9)
    for k in range(len(moved)):
        out[k] = _length(moved[k, 0], moved[k, 1])
        most = max(most, out[k])
    for k in range(len(moved)):
        share, product = out[k] / most, np.float32(1)
        for _ in range(power):
            product *= share
        out[k] = product + np.float32(1e-6)


@njit(**PART)
def _mirrored(index: int, count: int) -> int:
    if index < 0:
        return min(1, count - 1)
    return max(count - 2, 0) if index >= count else index


@njit(**PART)
def _strain(moved: Any, i: int, j: int, scale: Any) -> Any:
    """Norm of the strain tensor at a grid point, with slopes smoothed as by Sobel's operator."""
    height, width = moved.shape[:2]
    xx = xy = yx = yy = np.float32(0)
    for k in range(-1, 2):
        weight = np.float32(2 - abs(k)) * scale
        row, column = moved[_mirrored(i + k, height)], _mirrored(j + k, width)
        right, left = row[_mirrored(j + 1, width)], row[_mirrored(j - 1, width)]
        below, above = moved[_mirrored(i + 1, height)], moved[_mirrored(i - 1, height)]
        xx += weight * (right[0] - left[0])
        yx += weight * (right[1] - left[1])
        xy += weight * (below[column, 0] - above[column, 0])
        yy += weight * (below[column, 1] - above[column, 1])
    shear = yx + xy
    return np.sqrt(xx * xx + yy * yy + np.float32(0.5) * shear * shear)


@njit(**PART)
def _entropy(moved: Any, mask: Any, bin_mm: Any) -> float:
    """Entropy of the length of the displacement in a mask, in bits."""
    bins, found, most = np.empty(mask.size, np.int64), 0, 0
    for i in range(len(mask)):
        for j in range(mask.shape[1]):
            if mask[i, j]:
                bins[found] = int(_length(moved[i, j, 0], moved[i, j, 1]) / bin_mm)
                most = max(most, bins[found])
                found += 1
    counts, total = np.zeros(most + 1, np.int64), 0.0
    for k in range(found):
        counts[bins[k]] += 1
    for count in counts:
        if count:
            total -= count / found * np.log2(count / found)
    return max(total, 0.0)


@njit(**LOOP)
def calm_and_entropy(
    moved: Any,
    mask: Any,
    chosen: Any,
    per_point: Any,
    calm: tuple[float, float, float, int],
    bin_mm: Any,
) -> tuple[Any, float]:
    """Weights of points that probably stick, and the entropy of the displacement of all.

    Parameters
    ----------
    moved : (h, w, 2) float32
        Displacement.
    mask : (h, w) bool
        The contact.
    chosen : (n,) intp
        Flat indices of points of it.
    per_point : float32
        Grid points per mm.
    calm : (float, float, float, int)
        ``calm_quantile``, ``calm_strains``, ``min_strain`` and ``distance_power`` of
        ``STICK_REGION``.
    bin_mm : float32
        Width of a bin of the entropy.

    Returns
    -------
    weights : (n,) float32
        Of :func:`tactile_core.algorithms.slip.stick_region.calm_weights`.
    entropy_bits : float
    """
    weights, strains = np.empty(chosen.size, np.float32), np.empty(chosen.size, np.float32)
    scale, most = np.float32(0.125) * per_point, np.float32(1e-9)
    for k in range(chosen.size):
        i, j = chosen[k] // mask.shape[1], chosen[k] % mask.shape[1]
        strains[k] = _strain(moved, i, j, scale)
        weights[k] = _length(moved[i, j, 0], moved[i, j, 1])
        most = max(most, weights[k])
    typical = calm[1] * max(quantile_of(strains, calm[0]), calm[2])
    for k in range(chosen.size):
        share, far = weights[k] / most, np.float32(1)
        for _ in range(calm[3]):
            far *= share
        weights[k] = np.exp(-((strains[k] / typical) ** 2)) * (far + np.float32(1e-6))
    return weights, _entropy(moved, mask, bin_mm)


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


@njit(**LOOP)
def fitted_motion(
    moved: Any,
    position: Any,
    noise_mm: float,
    lag_tolerance: float,
    rounds: int,
    max_sine: float,
    lag: Any,
    weight: Any,
) -> tuple[Any, ...]:
    """Fit the rigid motion of the stick region; see ``stick_region.stick_region``.

    Parameters
    ----------
    moved, position : (n, 2) float32
    noise_mm, lag_tolerance : float
    rounds, max_sine
        Of ``STICK_REGION``.
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
    count = len(moved)
    x, y, moved_x, moved_y = np.empty((4, count))
    for k in range(count):
        x[k], y[k] = position[k, 0], position[k, 1]
        moved_x[k], moved_y[k] = moved[k, 0], moved[k, 1]
    x -= x.mean()
    y -= y.mean()
    whole = _weighted(x, y, moved_x, moved_y, np.ones(count, np.float32))
    square = whole[5] / count
    motion, rms_mm = (0.0, 0.0, 0.0, 0.0), 0.0
    for _ in range(rounds):
        motion = _rigid(_weighted(x, y, moved_x, moved_y, weight), max_sine)
        _lags(x, y, moved_x, moved_y, motion, lag)
        rms_mm = _rms(motion, square)
        _reweighted(lag, max(lag_tolerance * rms_mm, noise_mm), weight)
    turned = (0.0, 0.0, motion[2], motion[3])
    sheared_mm = _rms(_rigid(whole, max_sine), square)
    return motion[0], motion[1], motion[3], rms_mm, _rms(turned, square), sheared_mm
