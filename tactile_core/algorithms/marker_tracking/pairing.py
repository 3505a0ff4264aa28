"""Matches markers with their nearest detections."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Intp


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


UNMATCHED = -1  # Index of the detection of a marker that has none


def pair_nearest(expected_px: Array, found_px: Array, within_px: Array) -> Intp:
    """Match markers with detections that are mutually nearest.

    Parameters
    ----------
    expected_px : (N, 2) float64
        Predicted positions of the markers.
    found_px : (M, 2) float64
        Detections.
    within_px : (N,) float64
        Search radius of each marker; negative for a marker that is not matched.

    Returns
    -------
    (N,) intp
        Index of each marker's detection, or -1.
    """
    return np.asarray(pairings(expected_px[None], found_px, within_px)[0])


def pairings(expected_px: Array, found_px: Array, within_px: Array) -> Intp:
    """Match markers like :func:`pair_nearest` under each of P predictions, (P, N, 2) to (P, N)."""
    result = np.full(expected_px.shape[:2], UNMATCHED, np.intp)
    searching = np.flatnonzero(within_px >= 0)
    if not len(found_px) or not searching.size:
        return result
    asked_px, gate_px = expected_px[:, searching].reshape(-1, 2), within_px[searching]
    # detections beyond the widest gate, which are not found, belong to no marker
    widest_px = np.nextafter(gate_px.max(), np.inf)
    distances, indices = nearest(asked_px, found_px, 1, widest_px)
    shape = len(expected_px), len(searching)
    for one, distance, closest in zip(
        result, distances.reshape(shape), indices.reshape(shape), strict=True
    ):
        nearest_marker = np.full(len(found_px) + 1, UNMATCHED, np.intp)
        far_first = np.argsort(-distance, kind="stable")
        nearest_marker[closest[far_first]] = far_first
        mutual = nearest_marker[closest] == np.arange(len(searching))
        good = (distance <= gate_px) & mutual
        one[searching[good]] = closest[good]
    return result
