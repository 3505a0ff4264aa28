"""Kernels of :mod:`tactile_core.algorithms.displacement`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.arrays.types import Float32, Float64, UInt8
from tactile_core.algorithms.kernels.options import EXACT_ROW, LOOP, PART
from tactile_core.algorithms.kernels.rows import add_row, set_row


@njit(**LOOP)
def share_of_cells(mask: UInt8, share: Float32) -> None:
    """Average a mask over cells that divide it exactly, of at most 255 rows.

    Parameters
    ----------
    mask : (H, W) uint8
        0 or 1.
    share : (rows, columns) float32
        The result.
    """
    rows, columns = share.shape
    height, width = mask.shape[0] // rows, mask.shape[1] // columns
    sums = np.empty(mask.shape[1], np.uint8)
    pixels = np.float32(height * width)
    for i in range(rows):
        set_row(sums, np.uint8(0))
        for k in range(height):
            add_row(mask[i * height + k], sums)
        for j in range(columns):
            total = 0
            for k in range(width):
                total += sums[j * width + k]
            share[i, j] = np.float32(total) / pixels


@njit(**LOOP)
def traction_of(depth: Float32, blunting: float, x: Float32, y: Float32, wide: Float32) -> Any:
    """Divide a contact by the root of the depth in it, and return the centroid.

    Parameters
    ----------
    depth : (rows, columns) float32
        Distance from the border of the contact, in cells.
    blunting : float
        Added to the depth.
    x : (columns,) float32
    y : (rows,) float32
        Positions of the nodes.
    wide : (rows, columns) float32
        Share of each cell in contact, which the traction replaces.

    Returns
    -------
    x, y : float
    """
    total = along_x = along_y = 0.0
    for i in range(wide.shape[0]):
        in_row = 0.0
        for j in range(wide.shape[1]):
            if wide[i, j] > 0:
                wide[i, j] /= np.sqrt(depth[i, j] + np.float32(blunting))
                in_row += wide[i, j]
                along_x += wide[i, j] * x[j]
        total += in_row
        along_y += in_row * y[i]
    return along_x / total, along_y / total


@njit(inline="always")
def _place(at: Any, count: Any) -> Any:
    inside = min(max(at, np.float32(0)), np.float32(count - 1))
    # without a sign, so that no place is counted from the end
    low = min(np.uint64(inside), np.uint64(count - 2))
    return low, inside - np.float32(low)


@njit(inline="always")
def _sampled(plane: Float32, i: Any, j: Any, down: Any, right: Any) -> Any:
    below, after = i + np.uint64(1), j + np.uint64(1)
    upper = plane[i, j] + right * (plane[i, after] - plane[i, j])
    lower = plane[below, j] + right * (plane[below, after] - plane[below, j])
    return upper + down * (lower - upper)


@njit(**LOOP)
def elastic_columns(planes: Float32, origin: Any, at: Float32, columns: Float64) -> None:
    """Sample the elastic fields of a contact at the markers.

    Parameters
    ----------
    planes : (7, rows, columns) float32
        See :class:`tactile_core.algorithms.displacement.layer_response.LayerResponse`.
    origin : (x, y, width, height)
        Position of the first node relative to the centroid of the traction, and size of a cell.
    at : (N, 2) float32
        Markers, in cells.
    columns : (N, 8 or more) float64
        The result: x and y of each of the four fields.
    """
    rows, across = planes.shape[1:]
    value = np.empty(7, np.float32)
    for n in range(len(at)):
        j, right = _place(at[n, 0], across)
        i, down = _place(at[n, 1], rows)
        for k in range(7):
            value[k] = _sampled(planes[k], i, j, down, right)
        xx, yy, turned_y, spread_x, xy, turned_x, spread_y = value
        x, y = origin[0] + at[n, 0] * origin[2], origin[1] + at[n, 1] * origin[3]
        columns[n, 0], columns[n, 1], columns[n, 2], columns[n, 3] = xx, xy, xy, yy
        columns[n, 4], columns[n, 5] = x * xy - y * xx + turned_x, x * yy - y * xy + turned_y
        columns[n, 6], columns[n, 7] = x * xx + y * xy + spread_x, x * xy + y * yy + spread_y


@njit(**LOOP)
def fitted(columns: Float64, weighted: Float64, ridge: float, tiny: float) -> Any:
    """Fit the elastic fields to the displacements of the markers.

    Parameters
    ----------
    columns : (N, 10) float64
        x and y of each of four fields, and of the displacement.
    weighted : (N, 10) float64
        The same, multiplied by the inverse covariance.
    ridge, tiny : float
        Regularisation relative to the diagonal, and the least diagonal.

    Returns
    -------
    strength : (4,) float64
    residual : (2, N) float32
        Displacement without the fields.
    weighted_residual : (N, 2) float64
    """
    fields = columns.shape[1] // 2 - 1
    products = np.zeros((fields, fields + 1))
    for n in range(len(columns)):
        for a in range(fields):
            x, y = columns[n, 2 * a], columns[n, 2 * a + 1]
            for b in range(fields + 1):
                products[a, b] += x * weighted[n, 2 * b] + y * weighted[n, 2 * b + 1]
    size = np.empty(fields)
    for a in range(fields):
        size[a] = np.sqrt(max(products[a, a], tiny))
    for a in range(fields):
        for b in range(fields):
            products[a, b] /= size[a] * size[b]
        products[a, a] += ridge
        products[a, fields] /= size[a]
    # Gaussian elimination; the matrix is positive definite
    for a in range(fields):
        for c in range(a + 1, fields):
            factor = products[c, a] / products[a, a]
            for b in range(a, fields + 1):
                products[c, b] -= factor * products[a, b]
    strength = np.empty(fields)
    for a in range(fields - 1, -1, -1):
        rest = products[a, fields]
        for b in range(a + 1, fields):
            rest -= products[a, b] * strength[b]
        strength[a] = rest / products[a, a]
    strength /= size
    residual = np.empty((2, len(columns)), np.float32)
    weighted_residual = np.empty((len(columns), 2))
    for n in range(len(columns)):
        for c in range(2):
            rest, weighted_rest = columns[n, 8 + c], weighted[n, 8 + c]
            for a in range(fields):
                rest -= columns[n, 2 * a + c] * strength[a]
                weighted_rest -= weighted[n, 2 * a + c] * strength[a]
            residual[c, n], weighted_residual[n, c] = rest, weighted_rest
    return strength, residual, weighted_residual


@njit(**EXACT_ROW)
def _total_row(planes: Float32, strength: Float32, x: Float32, y: Any, out: Any) -> None:
    right, down, turn, spread = strength
    xx, yy, turned_y, spread_x, xy, turned_x, spread_y = planes
    for j in range(x.size):
        along_x, along_y = right + spread * x[j] - turn * y, down + turn * x[j] + spread * y
        out[0][j] = along_x * xx[j] + along_y * xy[j] + (turn * turned_x[j] + spread * spread_x[j])
        out[1][j] = along_x * xy[j] + along_y * yy[j] + (turn * turned_y[j] + spread * spread_y[j])


@njit(**LOOP)
def total_of_fields(
    planes: Float32, strength: Float32, x: Float32, y: Float32, total: Float32
) -> None:
    """Sum the elastic fields, each times its strength.

    Parameters
    ----------
    planes : (7, rows, columns) float32
    strength : (4,) float32
    x : (columns,) float32
    y : (rows,) float32
        Positions of the nodes relative to the centroid of the traction.
    total : (2, rows, columns) float32
        The result.
    """
    for i in range(len(y)):
        parts = (
            planes[0, i],
            planes[1, i],
            planes[2, i],
            planes[3, i],
            planes[4, i],
            planes[5, i],
            planes[6, i],
        )
        _total_row(parts, strength, x, y[i], (total[0, i], total[1, i]))


@njit(**PART)
def _sample(planes: Float32, at: Float32, values: Float32) -> None:
    rows, columns = planes.shape[1:]
    for m in range(at.shape[1]):
        j, right = _place(at[0, m], columns)
        i, down = _place(at[1, m], rows)
        values[0, m] = _sampled(planes[0], i, j, down, right)
        values[1, m] = _sampled(planes[1], i, j, down, right)


@njit(**LOOP)
def moved_to_present(
    sheared: Float32, undeformed: Float32, nodes: Float32, per_mm: Float32, iterations: int
) -> Any:
    """Change of a residual at some nodes when it moves to present positions.

    Parameters
    ----------
    sheared, undeformed : (2, rows, columns) float32
        The elastic fields, and the residual at undeformed positions.
    nodes : (2, M) float32
        x and y of the nodes, in cells.
    per_mm : (2, M) float32
        Cells per mm along x and y.
    iterations : int

    Returns
    -------
    (2, M) float32
    """
    start, known = np.empty(nodes.shape, np.float32), np.empty(nodes.shape, np.float32)
    _sample(sheared, nodes, known)
    _sample(undeformed, nodes, start)
    present, places = start.copy(), np.empty(nodes.shape, np.float32)
    # all nodes at once, because no node has to wait for another
    for _ in range(iterations):
        for m in range(nodes.shape[1]):
            for c in range(2):
                places[c, m] = nodes[c, m] - (known[c, m] + present[c, m]) * per_mm[c, m]
        _sample(undeformed, places, present)
    return present - start
