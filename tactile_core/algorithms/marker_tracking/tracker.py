"""Track the markers of the undeformed gel surface from frame to frame."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import Scene
from tactile_core.algorithms.marker_tracking.hypotheses import best_explanation
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.outrun import outrun_pitches
from tactile_core.algorithms.marker_tracking.pairing import UNMATCHED
from tactile_core.algorithms.marker_tracking.parameters import GROWTH, SMALL_MOTION, TRACKER
from tactile_core.algorithms.marker_tracking.small_motion import matched, steady


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
            self._around = Neighbourhood.of(self.reference_px)
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
        owner = self._matched(scene)
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
            self.began_displaced = self.lost or self._displaced(around)

    def _matched(self, scene: Scene) -> Intp:
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
        owner, (small, smooth) = matched(scene, self.px, self._momentum_px, searched)
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
        region = scene.connected(base_px, owner)
        if (region != owner).sum() > SMALL_MOTION.max_misfits:
            return None
        rounds = SMALL_MOTION.rounds
        grown = scene.grow(base_px, region, searched, rounds=rounds, relaxed=False)
        owner = scene.connected(base_px, grown)
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

    def _displaced(self, around: Neighbourhood) -> bool:
        smooth_px = around.fit(self.px - self.reference_px, self.seen.astype(np.float64))
        limit_px = TRACKER.small_motion_pitches * around.pitch_px
        return bool(np.hypot(*smooth_px.T).max() > limit_px)
