"""Places of points: rasterised, and their pitch."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array


@lru_cache(maxsize=16)
def from_middle(count: int) -> NDArray[np.float64]:
    """Coordinate of each of ``count`` pixels in a line, relative to its middle, (count,)."""
    places = np.asarray(np.arange(count) - (count - 1) / 2)
    places.setflags(write=False)
    return places


def nodes(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Column and row of every pixel, (h, w, 2)."""
    return np.indices(shape, np.float32)[::-1].transpose(1, 2, 0).copy()


def rasterise_points(points: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Rasterise points (N, 2), some perhaps outside: (h, w), 1 at their pixels and 0 elsewhere."""
    image = np.zeros(shape, np.uint8)
    columns, rows = np.rint(points.T).astype(np.intp)
    # a negative place is large without its sign
    inside = (columns.view(np.uintp) < shape[1]) & (rows.view(np.uintp) < shape[0])
    image.ravel()[(rows * shape[1] + columns)[inside]] = 1
    return image


def spacings(points: Array) -> Array:
    """Distance of each of (N, 2) points to its nearest neighbour, (N,); infinite for one point."""
    from scipy.spatial import KDTree

    found, _ = KDTree(points).query(points, k=[2])
    return np.asarray(found)[:, 0]


def pitch(points: Array) -> float:
    """Median distance to the nearest neighbour; infinite for a single point or none."""
    return float(np.median(spacings(points))) if len(points) else np.inf
