"""Spacing of points in a lattice, such as printed markers."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array


def spacings(points: Array) -> Array:
    """Distance of each of (N, 2) points to its nearest neighbour, (N,); infinite for one point."""
    from scipy.spatial import KDTree

    found, _ = KDTree(points).query(points, k=[2])
    return np.asarray(found)[:, 0]


def pitch(points: Array) -> float:
    """Median distance to the nearest neighbour; infinite for a single point or none."""
    return float(np.median(spacings(points))) if len(points) else np.inf
