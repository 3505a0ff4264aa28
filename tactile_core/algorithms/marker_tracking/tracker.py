"""Follows the markers of the resting skin from frame to frame."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.beginning import FEW_MISFITS, begun
from tactile_core.algorithms.marker_tracking.confidence import Confidence
from tactile_core.algorithms.marker_tracking.growth import FEWEST_MARKERS, SUPPORT, Scene
from tactile_core.algorithms.marker_tracking.hypotheses import best_explanation
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import NOBODY

_MOMENTUM = 0.7
_MISFITS = 0.12
_LEAST_SEEN, _LEAST_FOUND_AGAIN = 0.2, 0.4
_UNSEEN_WEIGHT = 0.02
"""Weight of a marker that is not seen; it matters only where no neighbour is seen."""

_DOUBTFUL = 0.3
"""Of the room around a marker: it is not looked for where its place is less certain."""

_UNSUPPORTED = 0.1
_SMALL_MOTION = 0.1


class MarkerTracker:
    """Keeps the identity of markers.

    Each marker is expected where it was, moved on by its momentum, and paired with the detection
    that is mutually nearest. Its neighbours on the resting skin then say where it should be: a
    plane through their motions, in which those that deviate lose their say. Markers that do not fit
    are dropped and looked for anew where the plane has them. When many do not fit, or the motion
    tears, the frame is explained in several ways, and only what the best of them have in common
    counts: a marker whose identity is not sure is not seen. Its place is then the plane's, with
    what set it off from its neighbours when it was last seen.

    Parameters
    ----------
    reference_px : (N, 2) float
        The markers on the resting skin.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Attributes
    ----------
    reference_px, px : (N, 2) float64
        Where each marker was on the resting skin, and where it is now.
    seen : (N,) bool
        False where ``px`` is inferred from neighbours, or the identity of the marker is not sure.
    lost : bool
        So few were found that none can be told apart; ``px`` stays as it was.
    began_displaced : bool or None
        Whether the first frame showed the markers away from the reference or could not be matched
        to it; None before that frame.
    """

    def __init__(self, reference_px: Array, *, compiled: bool = False) -> None:
        self.reference_px = np.asarray(reference_px, np.float64).reshape(-1, 2)
        count = len(self.reference_px)
        self._around: Neighbourhood | None = None
        if count >= FEWEST_MARKERS:
            self._around = Neighbourhood.of(self.reference_px, compiled=compiled)
            self._low_px = self.reference_px.min(axis=0)
            self._high_px = self.reference_px.max(axis=0)
        self.px = self.reference_px.copy()
        self.seen = np.zeros(count, np.bool_)
        self.lost = False
        self.began_displaced: bool | None = None
        self._followed = self.seen
        self._confidence = Confidence(count)
        self._momentum_px = np.zeros((count, 2))
        self._doubt_px = np.zeros(count)

    def follow(self, found_px: Array) -> None:
        """Find the markers among (M, 2) detections; any may be missing, others too many."""
        found_px = np.asarray(found_px, np.float64).reshape(-1, 2)
        if self._around is None:
            self.lost = True
            return
        scene = Scene(
            self._around,
            found_px,
            self._in_view(self._around.pitch_px),
            self._around.room_px(self.px),
            self._doubt_px,
        )
        owner, calm = self._explained(scene)
        known = owner >= 0
        share = _LEAST_FOUND_AGAIN if self.lost else _LEAST_SEEN
        self.lost = bool(
            np.count_nonzero(known) < max(FEWEST_MARKERS, share * np.count_nonzero(scene.in_view))
        )
        if self.lost:
            self.seen = self._followed = np.zeros(len(self.px), np.bool_)
            self._momentum_px[:] = 0
        else:
            self._accept(scene, self._around, owner, calm)
        if self.began_displaced is None:
            self.began_displaced = self.lost or self._displaced(self._around)

    def _explained(self, scene: Scene) -> tuple[Intp, bool]:
        count = len(self.px)
        if len(scene.found_px) < FEWEST_MARKERS:
            return np.full(count, NOBODY, np.intp), False
        sought = (self._doubt_px <= _DOUBTFUL * scene.room_px) | self.lost
        owner, calm = (None, False) if self.lost else self._continued(scene, sought)
        if owner is None:
            owner = best_explanation(
                scene, self.px, self._momentum_px, self.reference_px, sought, self._followed
            )
        return owner, calm

    def _continued(self, scene: Scene, sought: Bool) -> tuple[Intp | None, bool]:
        """The frame as a small step, None where it is not, and whether it is a calm one."""
        owner, (small, calm) = begun(scene, self.px, self._momentum_px, sought)
        if not small:
            return None, False
        if calm:
            return owner, True
        base_px = self.px + self._momentum_px
        step, known = scene.moved(base_px, owner)
        _, distance = scene.around.deviation(step, known)
        misfit = known & (distance > scene.tolerance(distance, known))
        if misfit.sum() > max(FEW_MISFITS, _MISFITS * known.sum()):
            return None, False
        owner = np.where(misfit, NOBODY, owner)
        held = scene.whole(base_px, owner)
        if (held != owner).sum() > FEW_MISFITS:
            return None, False
        owner = scene.whole(base_px, scene.grown(base_px, held, sought, rounds=4, relaxed=False))
        return scene.sure(base_px, owner, self._followed), False

    def _accept(self, scene: Scene, around: Neighbourhood, owner: Intp, calm: bool) -> None:
        followed = owner >= 0
        step_px, _ = scene.moved(self.px, owner)
        px = self.px + step_px
        self.seen = self._confidence.judge(
            scene,
            step_px,
            self._momentum_px,
            px - self.reference_px,
            followed,
            self._followed,
            calm,
        )
        self._doubt_px = np.where(followed, 0.0, self._doubt_px)
        if not followed.all():
            self._infer(around, px, step_px, followed)
            self._confidence.forget(scene, self._doubt_px, followed)
        self._momentum_px = _MOMENTUM * (px - self.px)
        self.px, self._followed = px, followed

    def _infer(self, around: Neighbourhood, px: Array, step_px: Array, seen: Bool) -> None:
        """Fill in the places of unseen markers: by step or by displacement, whichever is surer."""
        trust = np.where(seen, 1.0, _UNSEEN_WEIGHT)
        for _ in range(2):
            expected_px = around.fit(step_px, trust)
            step_px[~seen] = expected_px[~seen]
        doubt_px = self._doubt_px + 2 * self._strangeness(around, step_px - expected_px, seen)
        px[~seen] = (self.px + step_px)[~seen]
        moved_px = px - self.reference_px
        smooth_px = around.fit(moved_px, trust)
        smooth_doubt_px = 3 * self._strangeness(around, moved_px - smooth_px, seen)
        better = ~seen & (smooth_doubt_px < doubt_px)
        px[better] = (self.reference_px + smooth_px)[better]
        self._doubt_px = np.where(seen, 0.0, np.minimum(doubt_px, smooth_doubt_px))

    @staticmethod
    def _strangeness(around: Neighbourhood, deviation: Array, seen: Bool) -> Array:
        """How badly the seen markers around each one are told by their own neighbours, (N,) px."""
        distance = np.hypot(deviation[:, 0], deviation[:, 1])
        supported = around.supporters(seen) >= SUPPORT
        unknown = _UNSUPPORTED * around.pitch_px
        strangeness = around.nearby(distance, seen) * around.reach_beyond(seen)
        return np.where(supported, strangeness, unknown)

    def _in_view(self, pitch_px: float) -> Bool:
        (left, top), (right, bottom) = self._low_px - pitch_px / 2, self._high_px + pitch_px / 2
        x, y = self.px.T
        return np.asarray((x > left) & (x < right) & (y > top) & (y < bottom))

    def _displaced(self, around: Neighbourhood) -> bool:
        smooth_px = around.fit(self.px - self.reference_px, self.seen.astype(np.float64))
        return bool(np.hypot(*smooth_px.T).max() > _SMALL_MOTION * around.pitch_px)
