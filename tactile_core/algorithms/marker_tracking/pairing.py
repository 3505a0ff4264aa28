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
    # [noise sigmas] Residual at which a neighbour has half its weight in the robust fit.
    outlier_sigmas = 3.0
    min_sigma_pitches = 0.01  # [pitches] Lower bound of the noise estimate in the robust fit


class GROWTH:
    """Parameters of region growing and of its checks."""

    # [count] Fewest matched markers of an explanation. Source: an affine map has three unknowns
    # per axis; one more marker gives a residual.
    min_markers = 4
    # [count] Fewest matched neighbours that predict the position of a marker. Source: three
    # points define a plane.
    min_neighbours = 3
    # [pitches per pitch] Neighbours whose steps differ by more belong to different regions.
    tear_pitches = 0.45
    # [pitches] The allowed difference of steps grows with the distance up to this one.
    tear_reach_pitches = 1.3
    gate_spacings = 0.3  # [spacings] Search radius around the predicted position
    # [spacings] A marker that is closer to its prediction than this is accepted without further
    # checks.
    accepted_spacings = 0.1
    # [ratio] Maximum distance of a marker from its prediction relative to the distance of its
    # detection from the prediction of any other marker; the second for markers that were not
    # tracked in the previous frame.
    ambiguity_ratio = 0.5
    ambiguity_ratio_lost = 0.3
    # [spacings] Bounds of the tolerance, the residual at which a marker is an outlier.
    min_tolerance = 0.06
    max_tolerance = 0.3
    # [spacings] Lower bound of the tolerance while no detection is left that could be mistaken
    # for a missing marker.
    clutter_free_tolerance = 0.3
    # [ratio] Tolerance relative to the noise sigma of all residuals, and to the mean residual
    # nearby.
    typical_residuals = 3.5
    nearby_residuals = 2.5
    slack_pitches = 0.02  # [pitches] Added to the tolerance
    # [spacings] Residuals above it count as this much when those nearby are averaged.
    residual_cap = 0.25


class SMALL_MOTION:
    """Parameters of the first attempt at a frame, which assumes a small and smooth step."""

    # [spacings] Search radius around the predicted position. Source: half of a spacing; beyond it
    # another marker is closer.
    gate_spacings = 0.5
    min_share = 0.3  # [share of the markers searched for] Fewest matched markers
    max_misfits = 3  # [count] Most outliers that the attempt tolerates
    # [share of the matched markers] The same for many markers; the larger of both applies.
    max_misfit_share = 0.12
    rounds = 4  # [count] Rounds of region growing


class HYPOTHESES:
    """Parameters of the search among several hypotheses."""

    seed_gate_spacings = 0.45  # [spacings] Search radius of the matches that form seed regions
    # [pitches per pitch and pitches] As ``tear_pitches`` and ``tear_reach_pitches`` of
    # `GROWTH`, for seeds.
    seed_tear_pitches = 0.3
    seed_reach_pitches = 2.0
    max_seeds = 3  # [count] Seed regions per hypothesis, largest first
    min_seed_share = 0.04  # [share of the markers] Smallest seed region
    # [share of the markers] Seeds that agree on more markers are the same. Source: by hand, to
    # save time.
    same_seed_share = 0.98
    # [count] Rounds of region growing with the relaxed gate, then with the tolerance.
    growth_rounds = 15
    refinement_rounds = 3
    max_shifts = 3  # [count] Common shifts that are tried
    # [pitches] Longest common shift. Source: chosen on virtual strokes, which move by up to two
    # thirds of a pitch per frame.
    farthest_shift_pitches = 1.2
    bins_per_pitch = 6  # [count] Resolution of the histogram of shifts
    candidates = 6  # [count] Detections per marker that vote for a shift
    # [share of the markers] Explanations whose scores differ by less are equally good.
    score_tie = 0.05
    # [share of the markers] Weight of uneven steps, and of the mean step, in the score.
    strain_cost = 0.25
    motion_cost = 0.3
    # [pitches] Lower bound of a pair's distance when its uneven step is turned into a strain.
    min_distance_pitches = 0.7
    max_motion_pitches = 1.5  # [pitches] Longer steps cost no more


class TRACKER:
    """Parameters of the tracker."""

    momentum = 0.7  # [ratio] Predicted step relative to the last one
    # [share of the markers in view] With fewer matches the markers are lost; the second applies
    # until they are found again.
    min_tracked = 0.2
    min_recovered = 0.4
    # [ratio] Weight of an unseen marker. It matters only where no neighbour is seen. Source: by
    # hand, small compared with 1.
    unseen_weight = 0.02
    # [spacings] A marker whose position is less certain is not searched for.
    searched_spacings = 0.3
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
