"""Confidence in the identity of each tracked marker."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.marker_tracking.growth import Scene
from tactile_core.algorithms.marker_tracking.parameters import CONFIDENCE, GROWTH


class Confidence:
    """Remember which markers are identified with confidence.

    A marker loses confidence when it jumps, deviates from its neighbours, or returns after its
    inferred position was uncertain. All limits are relative to the spacing of the markers. They are
    narrower where a marker has few neighbours and wider where nearly none is missing, since it
    takes a gap to mistake one marker for another.

    A marker regains confidence once the displacement of the confident markers around it predicts
    its own. After a jump, or when its position was unknown, two tracked frames must agree, since in
    a single frame a gap may put a neighbour in its place.

    A marker whose residual is larger than those nearby may be a speck. It is not seen in this
    frame, without further consequences.
    """

    def __init__(self, count: int) -> None:
        self._confident = np.ones(count, np.bool_)
        self._agreed = np.zeros(count, np.bool_)

    @property
    def complete(self) -> bool:
        """Whether every marker is identified with confidence, and agreed with its neighbours."""
        return bool(self._confident.all() and self._agreed.all())

    def judge(
        self,
        scene: Scene,
        step_px: Array,
        momentum_px: Array,
        displaced_px: Array,
        tracked: Bool,
        before: Bool,
        smooth: bool,
    ) -> Bool:
        """Update the confidence, and return the markers that are seen.

        Parameters
        ----------
        scene : Scene
            Its uncertainty is that before this frame.
        step_px, momentum_px, displaced_px : (N, 2) float64
            Step of each marker, its predicted step, and its displacement from the reference.
        tracked, before : (N,) bool
            Markers that are matched in this frame, and in the previous one.
        smooth : bool
            Whether all matched markers moved as their neighbours do, by less than half a spacing.

        Returns
        -------
        (N,) bool
        """
        if smooth and tracked.all() and self._confident.all():
            # none of the limits below can be exceeded
            self._agreed = tracked
            return tracked
        residual_px = step_px - scene.around.fit(step_px, tracked.astype(np.float64))
        distance = np.hypot(residual_px[:, 0], residual_px[:, 1])
        allowed_px = self._allowance(scene, tracked) * scene.spacing_px
        surprise_px = self._surprise_px(step_px, momentum_px, tracked)
        jumped = surprise_px > CONFIDENCE.jump_spacings * allowed_px
        jumped |= distance > CONFIDENCE.deviation_spacings * allowed_px
        jumped &= tracked
        uncertain = scene.uncertainty_px > CONFIDENCE.uncertain_spacings * allowed_px
        returned = tracked & ~before & uncertain
        self._agreed = self._agreed & ~jumped
        self._confident = self._confident & ~jumped & ~returned
        if self._confident.all():
            self._agreed = self._agreed | tracked
        else:
            agrees = self._consistent(scene, displaced_px, tracked)
            self._confident = self._confident | (agrees & self._agreed)
            self._agreed = np.where(tracked, agrees, self._agreed)
        outlier = self._outlier(scene, distance, tracked, allowed_px)
        return np.asarray(tracked & self._confident & ~outlier)

    def forget(self, scene: Scene, uncertainty_px: Array, tracked: Bool) -> None:
        """Drop confidence in markers whose inferred position is uncertain or poorly supported."""
        support = scene.around.supporters(tracked & self._confident)
        supported = tracked | (support >= GROWTH.min_neighbours)
        spacing_px = scene.spacing_px
        certain = uncertainty_px <= CONFIDENCE.uncertain_spacings * spacing_px
        located = uncertainty_px <= CONFIDENCE.unknown_spacings * spacing_px
        self._confident = self._confident & supported & certain
        self._agreed = self._agreed & supported & located

    @staticmethod
    def _allowance(scene: Scene, tracked: Bool) -> Array:
        """Factor (N,) of the limits: small with few neighbours, large with nearly all of them."""
        known = scene.around.supporters(tracked)
        most = scene.around.index.shape[1] - CONFIDENCE.max_gaps
        allowance = np.where(known >= most, CONFIDENCE.full_neighbours_allowance, 1.0)
        few = known < GROWTH.min_neighbours
        return np.where(few, CONFIDENCE.few_neighbours_allowance, allowance)

    @staticmethod
    def _surprise_px(step_px: Array, momentum_px: Array, tracked: Bool) -> Array:
        """Distance (N,) of each step from zero, its momentum or the median step, the least, px."""
        common_px = np.median(step_px[tracked], axis=0) if tracked.any() else 0.0
        surprises_px = np.stack([step_px, step_px - momentum_px, step_px - common_px])
        return np.asarray(np.sqrt(np.einsum("kij,kij->ki", surprises_px, surprises_px).min(axis=0)))

    @staticmethod
    def _outlier(scene: Scene, distance: Array, tracked: Bool, allowed_px: Array) -> Bool:
        """Markers (N,) whose residual exceeds the limit and the residuals nearby."""
        clutter = CONFIDENCE.clutter_factor * scene.clutter_tolerance(tracked) ** 3
        limit_px = max(CONFIDENCE.outlier_spacings, clutter) * allowed_px
        outlier = distance > limit_px
        if outlier.any():
            capped = np.minimum(distance, GROWTH.residual_cap * scene.spacing_px)
            nearby = scene.around.nearby(capped, tracked)
            outlier &= distance > limit_px + CONFIDENCE.outlier_residuals * nearby
        return np.asarray(outlier)

    def _consistent(self, scene: Scene, displaced_px: Array, tracked: Bool) -> Bool:
        """Confident markers and, outwards from them, those whose displacement they predict."""
        around = scene.around
        limit_px = CONFIDENCE.agreement_spacings * scene.spacing_px
        consistent = tracked & self._confident
        while (consistent != tracked).any():
            predicted_px = around.fit(displaced_px, consistent.astype(np.float64))
            residual_px = displaced_px - predicted_px
            distance = np.hypot(residual_px[:, 0], residual_px[:, 1])
            near = distance * around.extrapolation(consistent) ** 2 < limit_px
            supported = around.supporters(consistent) >= GROWTH.min_neighbours
            added = tracked & ~consistent & near & supported
            if not added.any():
                break
            consistent = consistent | added
        return consistent
