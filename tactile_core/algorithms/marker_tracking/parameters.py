"""Parameters of marker tracking.

Nothing sets them from outside: lengths are relative to the spacing of the markers, so they hold for
any print and resolution. Two units occur: a *pitch* is the median distance between neighbours in
the reference; a *spacing* is the distance of one marker to its nearest neighbour, in the reference
or now, whichever is shorter.

Unless stated otherwise, values were chosen together on virtual strokes of a marked gel
(``experiments/sheared_markers.py``, ADR 26); no script derives them one by one.
"""

from __future__ import annotations

from typing import NamedTuple


class NeighbourhoodParameters(NamedTuple):
    """Parameters of the local plane fit.

    Attributes
    ----------
    neighbours : int, count
        Neighbours of each marker.
        Source: chosen on virtual strokes.
    kernel_reach : float, ratio
        Distance at which the weight of a neighbour reaches 0, relative to the farthest neighbour.
        Source: chosen on virtual strokes.
    ridge : float, squared kernel reaches
        Regularises the slopes of the plane where all neighbours are on one side, at borders.
        Source: chosen on virtual strokes.
    inside_pitches : float, pitches
        A marker is surrounded by its neighbours if their mean position is closer than this.
        Source: chosen on virtual strokes.
    outlier_sigmas : float, noise sigmas
        Residual at which a neighbour has half its weight in the robust fit.
        Source: chosen on virtual strokes.
    min_sigma_pitches : float, pitches
        Lower bound of the noise estimate in the robust fit.
        Source: chosen on virtual strokes.
    """

    neighbours: int = 10
    kernel_reach: float = 1.3
    ridge: float = 0.05
    inside_pitches: float = 1.1
    outlier_sigmas: float = 3.0
    min_sigma_pitches: float = 0.01


class GrowthParameters(NamedTuple):
    """Parameters of region growing and of its checks.

    Attributes
    ----------
    min_markers : int, count
        Fewest matched markers of an explanation.
        Source: an affine map has three unknowns per axis; one more marker gives a residual.
    min_neighbours : int, count
        Fewest matched neighbours that predict the position of a marker.
        Source: three points define a plane.
    tear_pitches : float, pitches per pitch
        Neighbours whose steps differ by more belong to different regions.
        Source: chosen on virtual strokes.
    tear_reach_pitches : float, pitches
        The allowed difference of steps grows with the distance up to this one.
        Source: chosen on virtual strokes.
    gate_spacings : float, spacings
        Search radius around the predicted position.
        Source: chosen on virtual strokes.
    accepted_spacings : float, spacings
        A marker that is closer to its prediction than this is accepted without further checks.
        Source: chosen on virtual strokes.
    ambiguity_ratio, ambiguity_ratio_lost : float, ratio
        Maximum distance of a marker from its prediction relative to the distance of its detection
        from the prediction of any other marker; the second for markers that were not tracked in
        the previous frame.
        Source: chosen on virtual strokes.
    min_tolerance, max_tolerance : float, spacings
        Bounds of the tolerance, the residual at which a marker is an outlier.
        Source: chosen on virtual strokes.
    clutter_free_tolerance : float, spacings
        Lower bound of the tolerance while no detection is left that could be mistaken for a
        missing marker.
        Source: chosen on virtual strokes.
    typical_residuals, nearby_residuals : float, ratio
        Tolerance relative to the noise sigma of all residuals, and to the mean residual nearby.
        Source: chosen on virtual strokes.
    slack_pitches : float, pitches
        Added to the tolerance.
        Source: chosen on virtual strokes.
    residual_cap : float, spacings
        Residuals above it count as this much when those nearby are averaged.
        Source: chosen on virtual strokes.
    """

    min_markers: int = 4
    min_neighbours: int = 3
    tear_pitches: float = 0.45
    tear_reach_pitches: float = 1.3
    gate_spacings: float = 0.3
    accepted_spacings: float = 0.1
    ambiguity_ratio: float = 0.5
    ambiguity_ratio_lost: float = 0.3
    min_tolerance: float = 0.06
    max_tolerance: float = 0.3
    clutter_free_tolerance: float = 0.3
    typical_residuals: float = 3.5
    nearby_residuals: float = 2.5
    slack_pitches: float = 0.02
    residual_cap: float = 0.25


class SmallMotionParameters(NamedTuple):
    """Parameters of the first attempt at a frame, which assumes a small and smooth step.

    Attributes
    ----------
    gate_spacings : float, spacings
        Search radius around the predicted position.
        Source: half of a spacing; beyond it another marker is closer.
    min_share : float, share of the markers searched for
        Fewest matched markers.
        Source: chosen on virtual strokes.
    max_misfits : int, count
        Most outliers that the attempt tolerates.
        Source: chosen on virtual strokes.
    max_misfit_share : float, share of the matched markers
        The same for many markers; the larger of both applies.
        Source: chosen on virtual strokes.
    rounds : int, count
        Rounds of region growing.
        Source: chosen on virtual strokes.
    """

    gate_spacings: float = 0.5
    min_share: float = 0.3
    max_misfits: int = 3
    max_misfit_share: float = 0.12
    rounds: int = 4


class HypothesisParameters(NamedTuple):
    """Parameters of the search among several hypotheses.

    Attributes
    ----------
    seed_gate_spacings : float, spacings
        Search radius of the matches that form seed regions.
        Source: chosen on virtual strokes.
    seed_tear_pitches, seed_reach_pitches : float, pitches per pitch and pitches
        As ``tear_pitches`` and ``tear_reach_pitches`` of :class:`GrowthParameters`, for seeds.
        Source: chosen on virtual strokes.
    max_seeds : int, count
        Seed regions per hypothesis, largest first.
        Source: chosen on virtual strokes.
    min_seed_share : float, share of the markers
        Smallest seed region.
        Source: chosen on virtual strokes.
    same_seed_share : float, share of the markers
        Seeds that agree on more markers are the same.
        Source: chosen by hand to save time; no script derives it.
    growth_rounds, refinement_rounds : int, count
        Rounds of region growing with the relaxed gate, then with the tolerance.
        Source: chosen on virtual strokes.
    max_shifts : int, count
        Common shifts that are tried.
        Source: chosen on virtual strokes.
    farthest_shift_pitches : float, pitches
        Longest common shift.
        Source: chosen on virtual strokes, which move by up to two thirds of a pitch per frame.
    bins_per_pitch : int, count
        Resolution of the histogram of shifts.
        Source: chosen on virtual strokes.
    candidates : int, count
        Detections per marker that vote for a shift.
        Source: chosen on virtual strokes.
    score_tie : float, share of the markers
        Explanations whose scores differ by less are equally good.
        Source: chosen on virtual strokes.
    strain_cost, motion_cost : float, share of the markers
        Weight of uneven steps, and of the mean step, in the score.
        Source: chosen on virtual strokes.
    min_distance_pitches : float, pitches
        Lower bound of a pair's distance when its uneven step is turned into a strain.
        Source: chosen on virtual strokes.
    max_motion_pitches : float, pitches
        Longer steps cost no more.
        Source: chosen on virtual strokes.
    """

    seed_gate_spacings: float = 0.45
    seed_tear_pitches: float = 0.3
    seed_reach_pitches: float = 2.0
    max_seeds: int = 3
    min_seed_share: float = 0.04
    same_seed_share: float = 0.98
    growth_rounds: int = 15
    refinement_rounds: int = 3
    max_shifts: int = 3
    farthest_shift_pitches: float = 1.2
    bins_per_pitch: int = 6
    candidates: int = 6
    score_tie: float = 0.05
    strain_cost: float = 0.25
    motion_cost: float = 0.3
    min_distance_pitches: float = 0.7
    max_motion_pitches: float = 1.5


class TrackerParameters(NamedTuple):
    """Parameters of the tracker.

    Attributes
    ----------
    momentum : float, ratio
        Predicted step relative to the last one.
        Source: chosen on virtual strokes.
    min_tracked, min_recovered : float, share of the markers in view
        With fewer matches the markers are lost; the second applies until they are found again.
        Source: chosen on virtual strokes.
    unseen_weight : float, ratio
        Weight of an unseen marker. It matters only where no neighbour is seen.
        Source: chosen by hand, small compared with 1; no script derives it.
    searched_spacings : float, spacings
        A marker whose position is less certain is not searched for.
        Source: chosen on virtual strokes.
    unsupported_pitches : float, pitches
        Uncertainty that a frame adds where fewer than three neighbours are seen.
        Source: chosen on virtual strokes.
    step_uncertainty, displacement_uncertainty : float, ratio
        Uncertainty relative to the residuals nearby, of a position inferred from steps and of one
        inferred from displacements.
        Source: chosen on virtual strokes.
    small_motion_pitches : float, pitches
        A larger smooth displacement in the first frame means that it does not show the reference.
        Source: chosen by hand; no script derives it.
    found_again : float, share of the markers seen before
        With so many, a motion that was too fast to be followed is understood again.
        Source: a row of markers at the border of the view is more than is missing then.
    """

    momentum: float = 0.7
    min_tracked: float = 0.2
    min_recovered: float = 0.4
    unseen_weight: float = 0.02
    searched_spacings: float = 0.3
    unsupported_pitches: float = 0.1
    step_uncertainty: float = 2.0
    displacement_uncertainty: float = 3.0
    small_motion_pitches: float = 0.1
    found_again: float = 0.95


NEIGHBOURHOOD = NeighbourhoodParameters()
GROWTH = GrowthParameters()
SMALL_MOTION = SmallMotionParameters()
HYPOTHESES = HypothesisParameters()
TRACKER = TrackerParameters()
