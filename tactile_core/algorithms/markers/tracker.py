"""The tracker: positions, momentum and uncertainty of the markers from frame to frame."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.markers.growth import Scene, outrun_pitches
from tactile_core.algorithms.markers.neighbourhood import GROWTH, UNMATCHED, Neighbourhood

# [ratio] Predicted step relative to the last one. Source: 0.35 to 0.7 track virtual strokes alike;
# without it, 90 instead of 22 of 260,000 places in fast ones are swapped.
_MOMENTUM = 0.7


class MarkerTracker:
    """Track markers and keep their identities.

    Each marker is predicted at its last position plus momentum, and matched with the detection
    that is mutually nearest. A plane through the steps of its neighbours in the reference [1]_ then
    checks the match: outliers are dropped, and searched for where the plane predicts them. If many
    markers are outliers, ambiguous or torn off, more hypotheses are tried: the motion continues,
    has stopped, is a shift that many markers share, or the surface is undeformed again. The one
    with most matches is kept.

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
        # [share] A motion that was too fast to be followed is understood again: less than a row of
        # markers at the border of the view is missing
        elif np.count_nonzero(self.seen) >= 0.95 * self._seen_until_outrun:
            self.outrun_pitches = 0.0  # a surface that was matched wrongly is torn somewhere
        self.outrun_pitches = max(self.outrun_pitches, outrun)

    def _follow(self, found_px: Array, around: Neighbourhood) -> None:
        in_view = self._in_view(around.pitch_px)
        scene = Scene(around, found_px, in_view, self._uncertainty_px)
        owner = self._match_markers(scene)
        known = owner >= 0
        # [share of the markers in view] with fewer they are lost
        enough = max(GROWTH.min_markers, 0.2 * np.count_nonzero(in_view))
        self.lost = bool(np.count_nonzero(known) < enough)
        if self.lost:
            self.seen = np.zeros(len(self.px), np.bool_)
            self._momentum_px[:] = 0
        else:
            self._accept(scene, around, owner)
        if self.began_displaced is None:
            self.began_displaced = self.lost or self._is_displaced(around)

    def _match_markers(self, scene: Scene) -> Intp:
        """Matches of all markers."""
        if not len(scene.found_px):
            return np.full(len(self.px), UNMATCHED, np.intp)
        certain_px = GROWTH.gate_spacings * scene.around.spacing_px
        searched = (self._uncertainty_px <= certain_px) | self.lost
        if not self.lost:
            owner = scene.match_step(self.px + self._momentum_px, searched)
            if owner is not None:
                return owner
        anywhere = np.ones_like(searched)
        hypotheses = [
            (self.px + self._momentum_px, searched),
            (self.px, searched),
            (self.px + scene.find_shift(self.px), searched),
            (self.reference_px, anywhere),
        ]
        return scene.match_best(hypotheses)

    def _accept(self, scene: Scene, around: Neighbourhood, owner: Intp) -> None:
        """Update positions and momentum from the matches."""
        seen = owner >= 0
        step_px, _ = scene.measure_steps(self.px, owner)
        px = self.px + step_px
        self._uncertainty_px = np.where(seen, 0.0, self._uncertainty_px)
        if not seen.all():
            self._infer(around, px, step_px, seen)
        self._momentum_px = _MOMENTUM * (px - self.px)
        self.px, self.seen = px, seen

    def _infer(self, around: Neighbourhood, px: Array, step_px: Array, seen: Bool) -> None:
        """Infer unseen positions from steps or from displacements, whichever is more certain."""
        trust = np.where(seen, 1.0, 0.02)  # matters only where no neighbour is seen
        for _ in range(2):
            expected_px = around.fit(step_px, trust)
            step_px[~seen] = expected_px[~seen]
        residual_px = self._residual_px(around, step_px - expected_px, seen)
        uncertainty_px = self._uncertainty_px + 2.0 * residual_px  # [residuals]
        px[~seen] = (self.px + step_px)[~seen]
        moved_px = px - self.reference_px
        smooth_px = around.fit(moved_px, trust)
        residual_px = self._residual_px(around, moved_px - smooth_px, seen)
        smooth_uncertainty_px = 3.0 * residual_px  # [residuals]
        better = ~seen & (smooth_uncertainty_px < uncertainty_px)
        px[better] = (self.reference_px + smooth_px)[better]
        least_px = np.minimum(uncertainty_px, smooth_uncertainty_px)
        self._uncertainty_px = np.where(seen, 0.0, least_px)

    @staticmethod
    def _residual_px(around: Neighbourhood, residual_px: Array, seen: Bool) -> Array:
        """Mean residual (N,) of the seen markers around each one, px; more outside of them."""
        distance = np.hypot(residual_px[:, 0], residual_px[:, 1])
        supported = around.supporters(seen) >= GROWTH.min_neighbours
        unknown = 0.1 * around.pitch_px  # [pitches] added by a frame where fewer are seen
        nearby = around.nearby(distance, seen) * around.extrapolation(seen)
        return np.where(supported, nearby, unknown)

    def _in_view(self, pitch_px: float) -> Bool:
        (left, top), (right, bottom) = self._low_px - pitch_px / 2, self._high_px + pitch_px / 2
        x, y = self.px.T
        return np.asarray((x > left) & (x < right) & (y > top) & (y < bottom))

    def _is_displaced(self, around: Neighbourhood) -> bool:
        smooth_px = around.fit(self.px - self.reference_px, self.seen.astype(np.float64))
        limit_px = 0.1 * around.pitch_px  # [pitches] a larger one is not of the reference
        return bool(np.hypot(*smooth_px.T).max() > limit_px)
