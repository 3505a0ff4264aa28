"""Kernels of :mod:`tactile_core.algorithms.marker_tracking`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP, PART


@njit(**LOOP)
def neighbours_plane(index: Any, moments: Any, values: Any, weight: Any) -> Any:
    """Fit a weighted plane to the neighbours of each marker, and evaluate it at the marker.

    Parameters
    ----------
    index : (N, k) int
        Neighbours of each marker.
    moments : (N, k, 6) float64
        1, x, y, xx, xy and yy of each neighbour relative to the marker, weighted by distance.
    values : (N, 2) float64
    weight : (N,) float64
        Weight of each marker.

    Returns
    -------
    (N, 2) float64
    """
    count, neighbours = index.shape
    out = np.zeros((count, 2))
    for i in range(count):
        one = x = y = xx = xy = yy = 0.0
        for k in range(neighbours):
            w = weight[index[i, k]]
            one += w * moments[i, k, 0]
            x += w * moments[i, k, 1]
            y += w * moments[i, k, 2]
            xx += w * moments[i, k, 3]
            xy += w * moments[i, k, 4]
            yy += w * moments[i, k, 5]
        a, b, c = xx * yy - xy * xy, xy * y - x * yy, x * xy - xx * y
        determinant = max(one * a + x * b + y * c, 1e-12)
        for k in range(neighbours):
            j = index[i, k]
            share = weight[j] * (a * moments[i, k, 0] + b * moments[i, k, 1] + c * moments[i, k, 2])
            out[i, 0] += share * values[j, 0]
            out[i, 1] += share * values[j, 1]
        out[i, 0] /= determinant
        out[i, 1] /= determinant
    return out


@njit(**PART)
def _cells(found: Any, within: Any) -> tuple[Any, Any, Any, tuple[float, float, float, int, int]]:
    """Sort detections into square cells as wide as the widest gate.

    Returns
    -------
    start : (cells + 1,) int64
        Where the detections of each cell begin in ``order``; cells are numbered row by row.
    order : (M,) int64
    sorted_px : (M, 2) float64
        The detections in that order.
    grid : (float, float, float, int, int)
        Left and top border, side of a cell, rows and columns.
    """
    others, side = len(found), 1e-6
    for gate in within:
        side = max(side, gate)
    left, top = right, bottom = found[0, 0], found[0, 1]
    for j in range(others):
        left, right = min(left, found[j, 0]), max(right, found[j, 0])
        top, bottom = min(top, found[j, 1]), max(bottom, found[j, 1])
    columns = min(int((right - left) / side) + 1, 1024)
    rows = min(int((bottom - top) / side) + 1, 1024)
    start = np.zeros(rows * columns + 1, np.int64)
    cell = np.empty(others, np.int64)
    for j in range(others):
        column = min(int((found[j, 0] - left) / side), columns - 1)
        row = min(int((found[j, 1] - top) / side), rows - 1)
        cell[j] = row * columns + column
        start[cell[j] + 1] += 1
    for c in range(rows * columns):
        start[c + 1] += start[c]
    order, filled = np.empty(others, np.int64), start[:-1].copy()
    sorted_px = np.empty((others, 2))
    for j in range(others):
        k = filled[cell[j]]
        order[k], sorted_px[k, 0], sorted_px[k, 1] = j, found[j, 0], found[j, 1]
        filled[cell[j]] += 1
    return start, order, sorted_px, (left, top, side, rows, columns)


@njit(**PART)
def _paired(expected: Any, within: Any, cells: Any) -> Any:
    """Do what :func:`mutual_nearest` does, with the cells of the detections."""
    start, order, sorted_px, (left, top, side, rows, columns) = cells
    count = len(expected)
    nearest, owner = np.empty(count, np.int64), np.empty(order.size, np.int64)
    shortest = np.empty(order.size)
    for j in range(order.size):
        owner[j], shortest[j] = -1, np.inf
    for i in range(count):
        nearest[i] = -1
        if within[i] < 0:
            continue
        best, closest = np.inf, -1
        column = int(np.floor((expected[i, 0] - left) / side))
        row = int(np.floor((expected[i, 1] - top) / side))
        first, end = max(column - 1, 0), min(column + 2, columns)
        if first >= end:
            continue
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for k in range(start[r * columns + first], start[r * columns + end]):
                x, y = sorted_px[k, 0] - expected[i, 0], sorted_px[k, 1] - expected[i, 1]
                squared = x * x + y * y
                if squared < best:
                    best, closest = squared, k
        if closest >= 0:
            j = order[closest]
            nearest[i] = j
            if best < shortest[j]:
                shortest[j], owner[j] = best, i
            if best > within[i] * within[i]:
                nearest[i] = -1
    for i in range(count):
        if nearest[i] >= 0 and owner[nearest[i]] != i:
            nearest[i] = -1
    return nearest


@njit(**LOOP)
def mutual_nearest(expected: Any, found: Any, within: Any) -> Any:
    """Match markers and detections that are mutually nearest.

    Detections are sorted into square cells as wide as the widest gate, so that only nine cells are
    searched.

    Parameters
    ----------
    expected : (N, 2) float64
        Predicted places of the markers.
    found : (M, 2) float64
        Detections, at least one.
    within : (N,) float64
        Gate of each marker; negative to leave it out.

    Returns
    -------
    (N,) int64
        Index of the detection, or -1.
    """
    return _paired(expected, within, _cells(found, within))


@njit(**LOOP)
def spacing(places: Any, index: Any, nearest: Any) -> Any:
    """Distance of each marker to its nearest neighbour now or in the reference, the shorter.

    Parameters
    ----------
    places : (N, 2) float64
        Positions now.
    index : (N, k) int
        Neighbours of each marker.
    nearest : (N,) float64
        Distance in the reference.

    Returns
    -------
    (N,) float64
    """
    out = np.empty(len(places))
    for i in range(len(places)):
        least = nearest[i] ** 2
        for k in range(index.shape[1]):
            x = places[index[i, k], 0] - places[i, 0]
            y = places[index[i, k], 1] - places[i, 1]
            least = min(least, x * x + y * y)
        out[i] = np.sqrt(least)
    return out


@njit(**LOOP)
def small_step(
    places: tuple[Any, Any, Any],
    within: Any,
    accepted: Any,
    neighbours: tuple[Any, Any],
    limits: tuple[int, float, int],
) -> tuple[Any, bool, bool]:
    """Match markers after a small step, and judge whether it is smooth.

    Parameters
    ----------
    places : (last, momentum, found)
        (N, 2), (N, 2) and (M, 2) float64; at least one detection.
    within : (N,) float64
        Gate of each marker; negative to leave it out.
    accepted : (N,) float64
        Largest distance of a marker from its neighbours' prediction in a smooth step.
    neighbours : (index, moments)
        See :func:`neighbours_plane`.
    limits : (most misfits, fewest matches, fewest neighbours)
        See :func:`tactile_core.algorithms.marker_tracking.small_motion.matched`.

    Returns
    -------
    owner : (N,) int64
        Index of each marker's detection, or -1.
    small, smooth : bool
    """
    last, momentum, found = places
    index, moments = neighbours
    most_misfits, enough, fewest = limits
    base = last + momentum
    cells = _cells(found, within)
    owner, unmoved = _paired(base, within, cells), _paired(last, within, cells)
    count, misfits = 0, 0
    known, step = np.zeros(len(last)), np.zeros(last.shape)
    for i in range(len(last)):
        j = owner[i]
        if j >= 0:
            count += 1
            misfits += unmoved[i] >= 0 and unmoved[i] != j
            known[i] = 1
            step[i, 0], step[i, 1] = found[j, 0] - base[i, 0], found[j, 1] - base[i, 1]
    if misfits > most_misfits or count < enough:
        return owner, False, False
    if count < min(len(last), len(found)):
        return owner, True, False
    expected = neighbours_plane(index, moments, step, known)
    for i in range(len(last)):
        if owner[i] < 0:
            continue
        if np.hypot(step[i, 0] - expected[i, 0], step[i, 1] - expected[i, 1]) > accepted[i]:
            return owner, True, False
        support = 0
        for k in range(index.shape[1]):
            support += owner[index[i, k]] >= 0
        if support < fewest and count < len(last):
            return owner, True, False
    return owner, True, True


@njit(**LOOP)
def steady_step(
    places: tuple[Any, Any, Any],
    neighbours: tuple[Any, Any, Any],
    limits: tuple[float, float, int, float],
) -> tuple[bool, Any, Any]:
    """Follow markers that all make a small, smooth step.

    Parameters
    ----------
    places : (last, momentum, found)
        (N, 2), (N, 2) and (M, 2) float64; at least as many detections as markers.
    neighbours : (index, shares, nearest)
        ``index``, ``shares`` and ``nearest_px`` of
        :class:`tactile_core.algorithms.marker_tracking.neighbourhood.Neighbourhood`.
    limits : (gate, accepted, most misfits, momentum)
        See :func:`tactile_core.algorithms.marker_tracking.small_motion.steady`.

    Returns
    -------
    steady : bool
        Whether they do; if not, the other results say nothing.
    places : (N, 2) float64
        Present places.
    momentum : (N, 2) float64
    """
    last, momentum, found = places
    index, shares, nearest = neighbours
    gate, accepted, most_misfits, kept = limits
    now, next_step = np.empty(last.shape), np.empty(last.shape)
    apart, base, step = spacing(last, index, nearest), np.empty(last.shape), np.empty(last.shape)
    within, misfits = np.empty(len(last)), 0
    for i in range(len(last)):
        within[i] = gate * apart[i]
        base[i, 0], base[i, 1] = last[i, 0] + momentum[i, 0], last[i, 1] + momentum[i, 1]
    cells = _cells(found, within)
    owner, unmoved = _paired(base, within, cells), _paired(last, within, cells)
    for i in range(len(last)):
        j = owner[i]
        if j < 0:
            return False, now, next_step
        misfits += unmoved[i] >= 0 and unmoved[i] != j
        step[i, 0], step[i, 1] = found[j, 0] - base[i, 0], found[j, 1] - base[i, 1]
    for i in range(len(last)):
        x, y, limit = step[i, 0], step[i, 1], accepted * apart[i]
        for k in range(index.shape[1]):
            x -= shares[i, k] * step[index[i, k], 0]
            y -= shares[i, k] * step[index[i, k], 1]
        if misfits > most_misfits or x * x + y * y > limit * limit:
            return False, now, next_step
        for c in range(2):
            now[i, c] = last[i, c] + (found[owner[i], c] - last[i, c])
            next_step[i, c] = kept * (now[i, c] - last[i, c])
    return True, now, next_step
