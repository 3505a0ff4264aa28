"""How far apart points are that lie in a lattice, as printed markers do."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array


def spacings(points: Array) -> Array:
    """(N,) distance of each of (N, 2) points from the nearest other; infinite for a single one."""
    from scipy.spatial import KDTree

    distances, _ = KDTree(points).query(points, k=[2])
    return np.asarray(distances)[:, 0]


def pitch(points: Array) -> float:
    """Typical distance of neighbours; infinite for a single point or none."""
    return float(np.median(spacings(points))) if len(points) else np.inf
