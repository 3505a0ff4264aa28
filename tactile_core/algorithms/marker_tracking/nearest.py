"""Nearest points, from a k-d tree."""

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
