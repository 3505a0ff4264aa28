"""Nearest points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array


def nearest(
    places: Array, among: Array, count: int, within: float = np.inf
) -> tuple[Array, NDArray[np.intp]]:
    """Return distances and indices (N, count) of the nearest points of ``among``, nearest first.

    Beyond ``within`` the distance is infinite and the index is ``len(among)``.
    """
    from scipy.spatial import KDTree

    ranks = list(range(1, count + 1))
    distance, index = KDTree(among).query(places, k=ranks, distance_upper_bound=within)
    return np.asarray(distance), np.asarray(index, np.intp)


def closest_of(places: Array, among: Array) -> NDArray[np.intp]:
    """Return the index (N,) of the nearest of (M, 2) points for each of (N, 2) places.

    For some hundreds of points, one product of matrices takes a fifth of the time of a k-d tree.
    """
    # |p − f|² is least where p · f − f² / 2 is greatest
    points = np.empty((3, len(among)))
    points[:2] = among.T
    np.einsum("mc,mc->m", among, among, out=points[2])
    factors = np.empty((len(places), 3))
    factors[:, :2], factors[:, 2] = places, -0.5
    return np.asarray((factors @ points).argmax(axis=1))
