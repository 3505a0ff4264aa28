"""Spacing of points in a lattice, such as printed markers."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.distances import are_few, distances
from tactile_core.algorithms.arrays.types import Array


def spacings(points: Array) -> Array:
    """Distance of each of (N, 2) points to its nearest neighbour, (N,); infinite for one point."""
    if are_few(points, points):
        apart = distances(points, points)
        np.fill_diagonal(apart, np.inf)
        return np.asarray(apart.min(axis=1, initial=np.inf))
    from scipy.spatial import KDTree

    found, _ = KDTree(points).query(points, k=[2])
    return np.asarray(found)[:, 0]


def pitch(points: Array) -> float:
    """Median distance to the nearest neighbour; infinite for a single point or none."""
    return float(np.median(spacings(points))) if len(points) else np.inf
