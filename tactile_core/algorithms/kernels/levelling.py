"""Compiled form of the smooth error of a height, :mod:`tactile_core.algorithms.rest_area`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART, ROW
from tactile_core.algorithms.kernels.rows import add_row, set_row

_TINY = np.finfo(np.float64).tiny
"""Keeps a divisor from 0."""


@njit(**ROW)
def _product(left: Any, right: Any, out: Any) -> None:
    for i in range(left.shape[0]):
        for j in range(right.shape[1]):
            out[i, j] = left[i, 0] * right[0, j]
        for k in range(1, left.shape[1]):
            factor = left[i, k]
            for j in range(right.shape[1]):
                out[i, j] += factor * right[k, j]


@njit(**ROW)
def _energy(gain: Any, residual: Any) -> float:
    total = 0.0
    for i in range(residual.shape[0]):
        for j in range(residual.shape[1]):
            total += residual[i, j] * gain[i, j] * residual[i, j]
    return total


@njit(**PART)
def _gain(weight: Any, modes: Any, gain: Any) -> None:
    """Approximate inverse of the equations: that of a weight which is the same everywhere."""
    total = 0.0
    for i in range(weight.shape[0]):
        for j in range(weight.shape[1]):
            total += weight[i, j]
    mean = total / weight.size
    for i in range(weight.shape[0]):
        for j in range(weight.shape[1]):
            gain[i, j] = 1 / max(mean + modes[i, j], _TINY)


@njit(**PART)
def _multiply(image: Any, weight: Any) -> None:
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            image[i, j] *= weight[i, j]


@njit(**PART)
def _add_modes(modes: Any, direction: Any, change: Any) -> float:
    """Complete the change along a direction; return their product."""
    product = 0.0
    for i in range(change.shape[0]):
        for j in range(change.shape[1]):
            change[i, j] += modes[i, j] * direction[i, j]
            product += direction[i, j] * change[i, j]
    return product


@njit(**PART)
def _add(factor: float, step: Any, to: Any) -> None:
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] += factor * step[i, j]


@njit(**PART)
def _turn(gain: Any, residual: Any, share: float, direction: Any) -> None:
    for i in range(gain.shape[0]):
        for j in range(gain.shape[1]):
            direction[i, j] = gain[i, j] * residual[i, j] + share * direction[i, j]


@njit(**PART)
def _solve(
    source: Any,
    weight: Any,
    z: Any,
    transforms: tuple[Any, Any, Any, Any],
    modes: Any,
    limits: tuple[float, int],
    image: Any,
) -> None:
    """As ``solve_screened``; ``z`` holds the coefficients of the start, then of the result."""
    down, across, down_back, across_back = transforms
    shape = source.shape
    spare, change, residual = np.empty(shape), np.empty(shape), np.empty(shape)
    gain, direction = np.empty(shape), z.copy()
    _product(down, source, spare)
    _product(spare, across_back, residual)
    _gain(weight, modes, gain)
    enough = limits[0] ** 2 * _energy(gain, residual)
    length, energy = 1.0, 0.0
    for round_ in range(limits[1] + 1):
        # the first round subtracts what the start explains
        _product(down_back, direction, spare)
        _product(spare, across, image)
        _multiply(image, weight)
        _product(down, image, spare)
        _product(spare, across_back, change)
        product = _add_modes(modes, direction, change)
        if round_:
            length = energy / product
            _add(length, direction, z)
        _add(-length, change, residual)
        before, energy = energy, _energy(gain, residual)
        if not energy > enough:
            break
        _turn(gain, residual, energy / before if round_ else 0.0, direction)
    _product(down_back, z, spare)
    _product(spare, across, image)


@njit(**PART)
def _halved(cells: Any, out: Any) -> None:
    times = len(cells) // len(out)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            total = 0.0
            for k in range(times):
                for m in range(times):
                    total += cells[times * i + k, times * j + m]
            out[i, j] = total / times**2


@njit(**LOOP)
def smooth_error(
    height_mm: Any,
    distance: Any,
    margin: float,
    stiffness: float,
    raised: tuple[float, float],
    held: float,
    rounds: int,
    transforms: tuple[Any, Any, Any, Any],
    modes: Any,
    limits: tuple[float, int],
) -> Any:
    """Solve for the smooth error of a coarse height map.

    Parameters
    ----------
    height_mm : (t h, t w) float32
        Means over cells.
    distance : (t h, t w) float32
        From each of them to the nearest that is not undeformed, in cells.
    margin : float
        Distance at which a cell has 63 % of its weight, in cells.
    stiffness : float
        Square of a wide cell's side over the length in which an error vanishes.
    raised : (share, least)
        A cell is raised from this share of the greatest height on, but at least from the second
        number in mm on.
    held, rounds : float, int
        See :class:`~tactile_core.algorithms.rest_area.RestAreaParameters`.
    transforms : (down, across, their transposes)
        Orthonormal cosine transforms, (h, h) and (w, w) float64.
    modes : (h, w) float64
        Factor of each coefficient when the differences to neighbours are summed.
    limits : (tolerance, most_rounds)
        See :class:`~tactile_core.algorithms.poisson.screened.ScreenedParameters`.

    Returns
    -------
    (h, w) float64
    """
    near = np.empty(distance.shape)
    for i in range(near.shape[0]):
        for j in range(near.shape[1]):
            near[i, j] = 1 - np.exp(-((distance[i, j] / margin) ** 2))
    shape = modes.shape
    coarse, trust = np.empty(shape), np.empty(shape)
    _halved(height_mm, coarse)
    _halved(near, trust)
    error, z = np.zeros(shape), np.zeros(shape)
    weight, source = np.empty(shape), np.empty(shape)
    for _ in range(rounds):
        greatest = coarse[0, 0] - error[0, 0]
        for i in range(shape[0]):
            for j in range(shape[1]):
                greatest = max(greatest, coarse[i, j] - error[i, j])
        scale = max(raised[0] * greatest, raised[1])
        for i in range(shape[0]):
            for j in range(shape[1]):
                above = max(coarse[i, j] - error[i, j], 0.0) / scale
                trusted = stiffness * trust[i, j] / (1 + (above * above) ** 2)
                source[i, j], weight[i, j] = trusted * coarse[i, j], trusted + stiffness * held
        _solve(source, weight, z, transforms, modes, limits, error)
    return error


@njit(**PART)
def _cells_of(image: Any, offset: float, out: Any) -> None:
    """Average an image over cells that tile it, and subtract an offset."""
    rows, columns = len(image) // len(out), image.shape[1] // out.shape[1]
    total = np.empty(image.shape[1], np.float32)
    for i in range(len(out)):
        set_row(total, np.float32(0))
        for k in range(rows * i, rows * (i + 1)):
            add_row(image[k], total)
        for j in range(out.shape[1]):
            sum_of_cell = np.float32(0)
            for k in range(columns * j, columns * (j + 1)):
                sum_of_cell += total[k]
            out[i, j] = sum_of_cell / np.float32(rows * columns) - np.float32(offset)


@njit(**LOOP)
def rest_cells(
    images: tuple[Any, Any, Any],
    tilt: tuple[float, float],
    calm_slope: float,
    cells: Any,
    calm: Any,
) -> float:
    """Average heights and slopes over cells, and find those that are calm.

    Parameters
    ----------
    images : (height_mm, gx, gy)
        (H, W) float32 each.
    tilt : (float, float)
        Subtracted from the slopes.
    calm_slope : float
        A calm cell is less steep.
    cells : (3, h, w) float32
        Overwritten by the means over cells that tile the images.
    calm : (h, w) uint8
        Overwritten by 1 where calm, else 0.

    Returns
    -------
    float
        The greatest height.
    """
    _cells_of(images[0], 0.0, cells[0])
    _cells_of(images[1], tilt[0], cells[1])
    _cells_of(images[2], tilt[1], cells[2])
    most, highest = np.float32(calm_slope**2), cells[0, 0, 0]
    for i in range(calm.shape[0]):
        for j in range(calm.shape[1]):
            across, down = cells[1, i, j], cells[2, i, j]
            calm[i, j] = across * across + down * down < most
            highest = max(highest, cells[0, i, j])
    return float(highest)


@njit(**PART)
def _outflow(slope: float, here: int, there: int, rise: Any, rims: Any, steep: Any) -> None:
    if here != there:
        rise[here] += 0.5 * slope
        rise[there] -= 0.5 * slope
        rims[here] += 1
        rims[there] += 1
        steep[here] += there == 0
        steep[there] += here == 0


@njit(**LOOP)
def rest_area(
    part: Any,
    first_raised: int,
    count: int,
    height_mm: Any,
    gx: Any,
    gy: Any,
    raised_mm: float,
    shares: tuple[float, float],
) -> Any:
    """Find the undeformed cells; see :func:`tactile_core.algorithms.rest_area.rest_area`.

    Parameters
    ----------
    part : (H, W) int32
        Number of the calm part of each cell; 0 for a cell that is not calm.
    first_raised, count : int
        Number of the first part that is raised, and number of parts, with 0.
    height_mm, gx, gy : (H, W)
    raised_mm : float
        Height from which a part is raised.
    shares : main_share, steep_share
        A part of at least this share of the image is undeformed if it is not raised; a raised part
        is not undeformed if a larger share of its rim is steep.

    Returns
    -------
    (H, W) uint8
        1 where undeformed.
    """
    rows, columns = part.shape
    main_share, steep_share = shares
    rise, sizes, total = np.zeros(count), np.zeros(count), np.zeros(count)
    rims, steep = np.zeros(count), np.zeros(count)
    for i in range(rows):
        for j in range(columns):
            here = part[i, j]
            sizes[here] += 1
            total[here] += height_mm[i, j]
            if j + 1 < columns:
                _outflow(gx[i, j] + gx[i, j + 1], here, part[i, j + 1], rise, rims, steep)
            if i + 1 < rows:
                _outflow(gy[i, j] + gy[i + 1, j], here, part[i + 1, j], rise, rims, steep)
    undeformed = np.empty(part.shape, np.uint8)
    for i in range(rows):
        for j in range(columns):
            here = part[i, j]
            main = total[here] < raised_mm * sizes[here] and sizes[here] > main_share * part.size
            if here < first_raised:
                undeformed[i, j] = here > 0 and (rise[here] >= 0 or main)
            else:
                undeformed[i, j] = steep[here] <= steep_share * rims[here]
    return undeformed
