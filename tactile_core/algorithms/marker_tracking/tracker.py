"""The tracker of markers, and its hypotheses where markers are ambiguous."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import (
    Scene,
    match_markers,
    outrun_pitches,
    steady,
)
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import (
    GROWTH,
    HYPOTHESES,
    SMALL_MOTION,
    TRACKER,
    UNMATCHED,
    nearest,
)


def best_explanation(
    scene: Scene,
    last_px: Array,
    momentum_px: Array,
    reference_px: Array,
    searched: Bool,
    tracked: Bool,
) -> Intp:
    """Match a frame under several hypotheses, and keep the matches that the best ones share.

    The gel surface continues its motion, stops, moves by a shift that many detections share, or
    is undeformed again. Each hypothesis starts from its largest coherent regions and grows them.

    Parameters
    ----------
    scene : Scene
    last_px : (N, 2) float64
        Positions in the previous frame.
    momentum_px : (N, 2) float64
        Predicted steps.
    reference_px : (N, 2) float64
        Positions on the undeformed surface.
    searched : (N,) bool
        Markers whose last position is certain enough to search around it.
    tracked : (N,) bool
        Markers that were matched in the previous frame.

    Returns
    -------
    (N,) intp
        The detection of each marker; -1 where there is none, or where the best explanations
        disagree.
    """
    seeds: list[Intp] = []
    explanations: list[tuple[float, Intp]] = []
    all_markers = np.ones_like(searched)
    zero = np.zeros_like(last_px)
    tried = [(last_px + momentum_px, zero, searched), (last_px, zero, searched)]
    tried += [(last_px, zero + shift, searched) for shift in _shared_shifts(scene, last_px)]
    tried += [(reference_px, zero, all_markers)]
    growth_rounds, refinement_rounds = HYPOTHESES.growth_rounds, HYPOTHESES.refinement_rounds
    for base_px, guess_px, markers in tried:
        for seed in _seeds(scene, base_px, guess_px, markers):
            if any((seed == other).mean() > HYPOTHESES.same_seed_share for other in seeds):
                continue
            seeds.append(seed)
            owner = scene.grow(base_px, seed, markers, rounds=growth_rounds, relaxed=True)
            owner = scene.grow(base_px, owner, markers, rounds=refinement_rounds, relaxed=False)
            owner = scene.unambiguous(base_px, scene.keep_largest_region(base_px, owner), tracked)
            explanations.append((_score(scene, owner, last_px, momentum_px), owner))
    if not explanations:
        return np.full(len(last_px), UNMATCHED, np.intp)
    best, shared = max(explanations, key=lambda each: each[0])
    shared = shared.copy()
    for score, owner in explanations:
        if score > best - HYPOTHESES.score_tie:
            shared[owner != shared] = UNMATCHED
    return shared


def _seeds(scene: Scene, base_px: Array, guess_px: Array, searched: Bool) -> Iterator[Intp]:
    """Seed regions: large groups of mutual nearest neighbours with coherent steps."""
    gate = np.where(searched, HYPOTHESES.seed_gate_spacings * scene.spacing_px, -1.0)
    owner = scene.pair_markers(base_px + guess_px, gate)
    step, known = scene.steps(base_px, owner)
    if not known.any():
        return
    bonds = scene.around.coherent(
        step, known, HYPOTHESES.seed_tear_pitches, HYPOTHESES.seed_reach_pitches
    )
    region = scene.around.components(bonds)
    size = np.bincount(region[known])
    for number in np.argsort(-size, kind="stable")[: HYPOTHESES.max_seeds]:
        if size[number] >= max(GROWTH.min_markers, HYPOTHESES.min_seed_share * len(known)):
            yield np.where(known & (region == number), owner, UNMATCHED)


def _score(scene: Scene, owner: Intp, last_px: Array, momentum_px: Array) -> float:
    """Share of matched markers, less the cost of long or uneven steps or of their change."""
    step, known = scene.steps(last_px, owner)
    if known.sum() < GROWTH.min_markers:
        return -np.inf
    one, other = scene.around.pairs.T
    both = known[one] & known[other]
    apart = np.maximum(scene.around.apart[both], HYPOTHESES.min_distance_pitches)
    cost = np.inf
    for motion in (step, step - momentum_px):
        motion = motion / scene.around.pitch_px
        uneven = np.hypot(*(motion[one] - motion[other])[both].T)
        strain = np.minimum((uneven / apart) ** 2, 1)
        length = np.minimum(np.hypot(*motion[known].T), HYPOTHESES.max_motion_pitches)
        strain_cost = HYPOTHESES.strain_cost * strain.sum() / known.sum()
        cost = min(cost, strain_cost + HYPOTHESES.motion_cost * length.mean())
    return float(known.mean() - cost)


def _shared_shifts(scene: Scene, last_px: Array) -> list[Array]:
    """The (2,) shifts for which most detections vote, by a smoothed histogram."""
    pitch, bins_per_pitch = scene.around.pitch_px, HYPOTHESES.bins_per_pitch
    reach = HYPOTHESES.farthest_shift_pitches * pitch
    wanted = min(HYPOTHESES.candidates, len(scene.found_px))
    distance, index = nearest(last_px, scene.found_px, wanted, reach)
    marker, rank = np.nonzero(np.isfinite(distance))
    shift = scene.found_px[index[marker, rank]] - last_px[marker]
    bins = np.floor((shift + reach) / pitch * bins_per_pitch).astype(np.intp) + 1
    side = int(2 * HYPOTHESES.farthest_shift_pitches * bins_per_pitch) + 4
    votes = np.zeros((side, side))
    np.add.at(votes, (bins[:, 0], bins[:, 1]), 1)
    votes = np.asarray(cv2.blur(votes, (3, 3)))
    found = []
    for _ in range(HYPOTHESES.max_shifts):
        peak = np.unravel_index(int(votes.argmax()), votes.shape)
        if votes[peak] <= 0:
            break
        found.append(shift[(np.abs(bins - np.array(peak)) <= 1).all(axis=1)].mean(axis=0))
        x, y = (slice(max(int(at) - 2, 0), int(at) + 3) for at in peak)
        votes[x, y] = 0
    return found


class MarkerTracker:
    """Track markers and keep their identities.

    Each marker is predicted at its last position plus momentum, and matched with the detection
    that is mutually nearest. A robust plane fit through the steps of its neighbours in the
    reference [1]_ then checks the match: outliers are dropped, and searched for where the fit
    predicts them. If many markers are outliers, or the motion tears the surface, several
    hypotheses are tried by region growing, and only matches that the best ones share are kept.

    A marker without a match is not ``seen``. Its position is then the prediction of its neighbours,
    with its last offset from them.

    Parameters
    ----------
    reference_px : (N, 2) float
        The markers on the undeformed gel surface.

    Attributes
    ----------
    reference_px, px : (N, 2) float64
        Position of each marker on the undeformed surface, and in the last frame.
    seen : (N,) bool
        False where ``px`` is inferred from neighbours.
    lost : bool
        True if too few markers were matched in the last frame; ``px`` is then that of an earlier
        frame.
    outrun_pitches : float
        By how much of their pitch markers moved at least when they moved too far to be followed;
        0 if they did not, or nearly all of them were found again since.
    began_displaced : bool or None
        Whether the first frame showed displaced markers, or none that match the reference. None
        before the first frame.

    References
    ----------
    .. [1] W. S. Cleveland, "Robust locally weighted regression and smoothing scatterplots", Journal
       of the American Statistical Association 74(368), 1979.
    """

    def __init__(self, reference_px: Array) -> None:
        self.reference_px = np.asarray(reference_px, np.float64).reshape(-1, 2)
        count = len(self.reference_px)
        self._around: Neighbourhood | None = None
        if count >= GROWTH.min_markers:
            self._around = Neighbourhood.from_places(self.reference_px)
            self._low_px = self.reference_px.min(axis=0)
            self._high_px = self.reference_px.max(axis=0)
        self.px = self.reference_px.copy()
        self.seen = np.zeros(count, np.bool_)
        self.lost = False
        self.outrun_pitches = 0.0
        self._seen_until_outrun = 0
        self.began_displaced: bool | None = None
        self._complete = False
        self._momentum_px = np.zeros((count, 2))
        self._uncertainty_px = np.zeros(count)

    def update(self, found_px: Array) -> None:
        """Match the markers with the (M, 2) detections of the next frame.

        Detections may be missing or spurious, in any order.
        """
        found_px = np.asarray(found_px, np.float64).reshape(-1, 2)
        if self._around is None:
            self.lost = True
            return
        before_px, seen_before = self.px, self.seen
        self._follow(found_px, self._around)
        outrun = outrun_pitches(self.px - before_px, seen_before, self.seen, self._around.pitch_px)
        if not self.outrun_pitches:
            self._seen_until_outrun = int(np.count_nonzero(seen_before))
        elif np.count_nonzero(self.seen) >= TRACKER.found_again * self._seen_until_outrun:
            self.outrun_pitches = 0.0  # a surface that was matched wrongly is torn somewhere
        self.outrun_pitches = max(self.outrun_pitches, outrun)

    def _follow(self, found_px: Array, around: Neighbourhood) -> None:
        if self._complete:
            followed = steady(around, self.px, self._momentum_px, found_px)
            if followed is not None:
                self.px, self._momentum_px = followed
                return
        scene = Scene(
            around,
            found_px,
            self._in_view(around.pitch_px),
            around.spacing_px(self.px),
            self._uncertainty_px,
        )
        owner = self._match_markers(scene)
        known = owner >= 0
        share = TRACKER.min_recovered if self.lost else TRACKER.min_tracked
        enough = max(GROWTH.min_markers, share * np.count_nonzero(scene.in_view))
        self.lost = bool(np.count_nonzero(known) < enough)
        if self.lost:
            self.seen = np.zeros(len(self.px), np.bool_)
            self._momentum_px[:] = 0
        else:
            self._accept(scene, around, owner)
        self._complete = bool(self.seen.all())
        if self.began_displaced is None:
            self.began_displaced = self.lost or self._is_displaced(around)

    def _match_markers(self, scene: Scene) -> Intp:
        """Matches of all markers."""
        count = len(self.px)
        if len(scene.found_px) < GROWTH.min_markers:
            return np.full(count, UNMATCHED, np.intp)
        located = self._uncertainty_px <= TRACKER.searched_spacings * scene.spacing_px
        searched = located | self.lost
        owner = None if self.lost else self._small_motion(scene, searched)
        if owner is None:
            owner = best_explanation(
                scene, self.px, self._momentum_px, self.reference_px, searched, self.seen
            )
        return owner

    def _small_motion(self, scene: Scene, searched: Bool) -> Intp | None:
        """Matches under a small motion; None where it does not explain the frame."""
        owner, (small, smooth) = match_markers(scene, self.px, self._momentum_px, searched)
        if not small or smooth:
            return owner if small else None
        base_px = self.px + self._momentum_px
        step, known = scene.steps(base_px, owner)
        _, distance = scene.around.deviation(step, known)
        misfit = known & (distance > scene.tolerance(distance, known))
        few = max(SMALL_MOTION.max_misfits, SMALL_MOTION.max_misfit_share * known.sum())
        if misfit.sum() > few:
            return None
        owner = np.where(misfit, UNMATCHED, owner)
        region = scene.keep_largest_region(base_px, owner)
        if (region != owner).sum() > SMALL_MOTION.max_misfits:
            return None
        rounds = SMALL_MOTION.rounds
        grown = scene.grow(base_px, region, searched, rounds=rounds, relaxed=False)
        owner = scene.keep_largest_region(base_px, grown)
        return scene.unambiguous(base_px, owner, self.seen)

    def _accept(self, scene: Scene, around: Neighbourhood, owner: Intp) -> None:
        """Update positions and momentum from the matches."""
        seen = owner >= 0
        step_px, _ = scene.steps(self.px, owner)
        px = self.px + step_px
        self._uncertainty_px = np.where(seen, 0.0, self._uncertainty_px)
        if not seen.all():
            self._infer(around, px, step_px, seen)
        self._momentum_px = TRACKER.momentum * (px - self.px)
        self.px, self.seen = px, seen

    def _infer(self, around: Neighbourhood, px: Array, step_px: Array, seen: Bool) -> None:
        """Infer unseen positions from steps or from displacements, whichever is more certain."""
        trust = np.where(seen, 1.0, TRACKER.unseen_weight)
        for _ in range(2):
            expected_px = around.fit(step_px, trust)
            step_px[~seen] = expected_px[~seen]
        residual_px = self._residual_px(around, step_px - expected_px, seen)
        uncertainty_px = self._uncertainty_px + TRACKER.step_uncertainty * residual_px
        px[~seen] = (self.px + step_px)[~seen]
        moved_px = px - self.reference_px
        smooth_px = around.fit(moved_px, trust)
        residual_px = self._residual_px(around, moved_px - smooth_px, seen)
        smooth_uncertainty_px = TRACKER.displacement_uncertainty * residual_px
        better = ~seen & (smooth_uncertainty_px < uncertainty_px)
        px[better] = (self.reference_px + smooth_px)[better]
        least_px = np.minimum(uncertainty_px, smooth_uncertainty_px)
        self._uncertainty_px = np.where(seen, 0.0, least_px)

    @staticmethod
    def _residual_px(around: Neighbourhood, residual_px: Array, seen: Bool) -> Array:
        """Mean residual (N,) of the seen markers around each one, px; more outside of them."""
        distance = np.hypot(residual_px[:, 0], residual_px[:, 1])
        supported = around.supporters(seen) >= GROWTH.min_neighbours
        unknown = TRACKER.unsupported_pitches * around.pitch_px
        nearby = around.nearby(distance, seen) * around.extrapolation(seen)
        return np.where(supported, nearby, unknown)

    def _in_view(self, pitch_px: float) -> Bool:
        (left, top), (right, bottom) = self._low_px - pitch_px / 2, self._high_px + pitch_px / 2
        x, y = self.px.T
        return np.asarray((x > left) & (x < right) & (y > top) & (y < bottom))

    def _is_displaced(self, around: Neighbourhood) -> bool:
        smooth_px = around.fit(self.px - self.reference_px, self.seen.astype(np.float64))
        limit_px = TRACKER.small_motion_pitches * around.pitch_px
        return bool(np.hypot(*smooth_px.T).max() > limit_px)
