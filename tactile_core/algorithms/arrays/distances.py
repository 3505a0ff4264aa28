"""Distances between points of two sets, all of them at once.

A k-d tree is faster among many points. But importing scipy's takes half a second and 26 MiB, more
than anything that a stream does with a few hundred markers.
"""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float64

_FEW = 100_000
"""Distances up to which all of them take no longer than a k-d tree."""


def are_few(a: Array, b: Array) -> bool:
    """Whether all distances between two sets of points are faster than a k-d tree."""
    return len(a) * len(b) <= _FEW


def distances(a: Array, b: Array) -> Float64:
    """Distance (N, M) of each of (N, D) points to each of (M, D)."""
    square = np.zeros((len(a), len(b)))
    for one, other in zip(a.T, b.T, strict=True):
        apart = np.subtract.outer(one, other, dtype=np.float64)
        square += np.square(apart, out=apart)
    return np.sqrt(square, out=square)
