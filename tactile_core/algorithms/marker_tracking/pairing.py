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


class NEIGHBOURHOOD:
    """Parameters of the local plane fit."""

    neighbours = 10  # [count] Neighbours of each marker
    # [ratio] Distance at which the weight of a neighbour reaches 0, relative to the farthest
    # neighbour.
    kernel_reach = 1.3
    # [squared kernel reaches] Regularises the slopes of the plane where all neighbours are on one
    # side, at borders.
    ridge = 0.05
    # [pitches] A marker is surrounded by its neighbours if their mean position is closer than
    # this.
    inside_pitches = 1.1


class GROWTH:
    """Parameters of matching: of pairs, of their growth, and of the choice among hypotheses."""

    # [count] Fewest matched markers of an explanation. Source: an affine map has three unknowns
    # per axis; one more marker gives a residual.
    min_markers = 4
    # [count] Fewest matched neighbours that predict the position of a marker. Source: three
    # points define a plane.
    min_neighbours = 3
    # [spacings] Search radius of the first pairs. Source: half of a spacing; beyond it another
    # marker is closer.
    pair_spacings = 0.5
    # [spacings] Search radius around the position that the neighbours predict, and upper bound of
    # the tolerance. A marker whose position is less certain is not searched for.
    gate_spacings = 0.3
    # [spacings] Lower bound of the tolerance, the residual at which a marker is an outlier.
    min_tolerance = 0.1
    # [ratio] Tolerance relative to the noise sigma of all residuals, and to the mean residual
    # nearby.
    typical_residuals = 2.5
    # [count] Rounds of growth; it converges in fewer.
    rounds = 15
    # [count] Most markers of a small and smooth step that are outliers, ambiguous or torn off.
    # With more of them, other hypotheses are tried.
    max_outliers = 3
    # [share of the matched markers] The same for outliers among many markers; the larger of both
    # applies.
    max_outlier_share = 0.12
    # [pitches] Neighbours whose steps differ by more belong to different regions. Source: half of a
    # pitch; beyond it another marker is closer.
    tear_pitches = 0.5
    # [share of the markers] What a pair of neighbours costs whose steps differ by a pitch. Source:
    # 0.06 to 0.18 track virtual strokes alike; without it, one in five fast ones swaps markers.
    strain_cost = 0.12
    # [pitches] Longest shift that all markers may share. Source: chosen on virtual strokes, which
    # move by up to two thirds of a pitch per frame.
    farthest_shift_pitches = 1.2
    bins_per_pitch = 6  # [count] Resolution of the histogram of shifts
    shift_candidates = 6  # [count] Detections per marker that vote for a shift


class TRACKER:
    """Parameters of the tracker."""

    # [ratio] Predicted step relative to the last one. Source: 0.35 to 0.7 track virtual strokes
    # alike; without it, 90 instead of 22 of 260,000 places in fast ones are swapped.
    momentum = 0.7
    # [share of the markers in view] With fewer matches the markers are lost; the second applies
    # until they are found again.
    min_tracked = 0.2
    min_recovered = 0.4
    # [ratio] Weight of an unseen marker. It matters only where no neighbour is seen. Source: by
    # hand, small compared with 1.
    unseen_weight = 0.02
    # [pitches] Uncertainty that a frame adds where fewer than three neighbours are seen.
    unsupported_pitches = 0.1
    # [ratio] Uncertainty relative to the residuals nearby, of a position inferred from steps and
    # of one inferred from displacements.
    step_uncertainty = 2.0
    displacement_uncertainty = 3.0
    # [pitches] A larger smooth displacement in the first frame means that it does not show the
    # reference.
    small_motion_pitches = 0.1
    # [share of the markers seen before] With so many, a motion that was too fast to be followed
    # is understood again. Source: a row of markers at the border of the view is more than is
    # missing then.
    found_again = 0.95
