"""Matches markers with their nearest detections, and the limits of tracking."""

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
    result = np.full(len(expected_px), UNMATCHED, np.intp)
    searching = np.flatnonzero(within_px >= 0)
    if not len(found_px) or not searching.size:
        return result
    gate_px = within_px[searching]
    # detections beyond the widest gate, which are not found, belong to no marker
    widest_px = np.nextafter(gate_px.max(), np.inf)
    distance, index = nearest(expected_px[searching], found_px, 1, widest_px)
    distance, index = distance[:, 0], index[:, 0]
    nearest_marker = np.full(len(found_px) + 1, UNMATCHED, np.intp)
    far_first = np.argsort(-distance, kind="stable")
    nearest_marker[index[far_first]] = far_first
    mutual = nearest_marker[index] == np.arange(len(searching))
    good = (distance <= gate_px) & mutual
    result[searching[good]] = index[good]
    return result


class GROWTH:
    """Parameters of matching: of pairs, of their growth, and of the choice among hypotheses."""

    # [count] Fewest matched markers of an explanation. Source: an affine map has three unknowns
    # per axis; one more marker gives a residual.
    min_markers = 4
    # [count] Fewest matched neighbours that predict the position of a marker. Source: three
    # points define a plane.
    min_neighbours = 3
    # [spacings] Search radius around the position that the neighbours predict, and upper bound of
    # the tolerance. A marker whose position is less certain is not searched for.
    gate_spacings = 0.3
    # [spacings] Lower bound of the tolerance, the residual at which a marker is an outlier.
    min_tolerance = 0.1
    # [pitches] Neighbours whose steps differ by more belong to different regions. Source: half of a
    # pitch; beyond it another marker is closer.
    tear_pitches = 0.5
    bins_per_pitch = 6  # [count] Resolution of the histogram of shifts
