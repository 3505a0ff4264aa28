"""Confidence in the identity of each marker that is tracked."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.marker_tracking.growth import SUPPORT, Scene

_LEAP, _STRANGE, _AGREEING = 0.3, 0.15, 0.2
_UNSURE, _UNKNOWN = 0.1, 0.2
_GRANTED_TO_FEW, _GRANTED_TO_MANY = 0.3, 2.0
_MOST_GAPS = 1
_ODD, _ODDER_THAN_OTHERS = 0.04, 2.0
_ODD_WHEN_FREE = 6.0
"""Times the cube of what is free: a speck is likely only beside many gaps and impostors."""


class Confidence:
    """Remembers which markers are identified with confidence.

    All limits are shares of the distance to the nearest other marker. A marker loses confidence
    when it leaps, moves unlike its neighbours, or was inferred with doubt in earlier frames: sooner
    where it has few neighbours, later where hardly any marker is missing, because only a gap lets a
    neighbour be mistaken for it. It regains confidence once the confident markers around it predict
    its displacement; after a leap, or when its place was unknown, they must do so in two of the
    frames in which it is tracked, since gaps and chance can show a neighbour in its place in one
    frame. A marker that deviates from its neighbours' prediction further than they do may be a
    speck: it does not count as seen in this frame, and nothing else follows.
    """

    def __init__(self, count: int) -> None:
        self._sure = np.ones(count, np.bool_)
        self._agreed = np.zeros(count, np.bool_)

    def judge(
        self,
        scene: Scene,
        step_px: Array,
        momentum_px: Array,
        displaced_px: Array,
        followed: Bool,
        before: Bool,
        calm: bool,
    ) -> Bool:
        """Doubt markers, or trust them again, and say which are seen.

        Parameters
        ----------
        scene : Scene
            Its doubt is that before the markers were found in this frame.
        step_px, momentum_px, displaced_px : (N, 2) float64
            By how much each marker moved, was expected to, and is away from rest.
        followed, before : (N,) bool
            Markers that are found in this frame, and in the one before.
        calm : bool
            Whether all that are found moved as their neighbours do, by less than half their room.

        Returns
        -------
        (N,) bool
        """
        if calm and followed.all() and self._sure.all():
            # none of the limits below can be exceeded
            self._agreed = followed
            return followed
        off_px = step_px - scene.around.fit(step_px, followed.astype(np.float64))
        distance = np.hypot(off_px[:, 0], off_px[:, 1])
        granted_px = self._granted(scene, followed) * scene.room_px
        surprise_px = self._surprise_px(step_px, momentum_px, followed)
        leapt = (surprise_px > _LEAP * granted_px) | (distance > _STRANGE * granted_px)
        leapt &= followed
        returned = followed & ~before & (scene.doubt_px > _UNSURE * granted_px)
        self._agreed = self._agreed & ~leapt
        self._sure = self._sure & ~leapt & ~returned
        if self._sure.all():
            self._agreed = self._agreed | followed
        else:
            trusted = self._told_by_sure(scene, displaced_px, followed)
            self._sure = self._sure | (trusted & self._agreed)
            self._agreed = np.where(followed, trusted, self._agreed)
        return np.asarray(followed & self._sure & ~self._odd(scene, distance, followed, granted_px))

    def forget(self, scene: Scene, doubt_px: Array, followed: Bool) -> None:
        """Doubt markers whose inferred places are doubtful, or told by others that are."""
        told = followed | (scene.around.supporters(followed & self._sure) >= SUPPORT)
        self._sure = self._sure & told & (doubt_px <= _UNSURE * scene.room_px)
        self._agreed = self._agreed & told & (doubt_px <= _UNKNOWN * scene.room_px)

    @staticmethod
    def _granted(scene: Scene, followed: Bool) -> Array:
        """Less where few neighbours are known, more where hardly one is missing, (N,)."""
        known = scene.around.supporters(followed)
        most = scene.around.index.shape[1] - _MOST_GAPS
        granted = np.where(known >= most, _GRANTED_TO_MANY, 1.0)
        return np.where(known < SUPPORT, _GRANTED_TO_FEW, granted)

    @staticmethod
    def _surprise_px(step_px: Array, momentum_px: Array, followed: Bool) -> Array:
        """How far each marker moved, beyond what it did before or what most do, (N,) px."""
        common_px = np.median(step_px[followed], axis=0) if followed.any() else 0.0
        surprises_px = np.stack([step_px, step_px - momentum_px, step_px - common_px])
        return np.asarray(np.sqrt(np.einsum("kij,kij->ki", surprises_px, surprises_px).min(axis=0)))

    @staticmethod
    def _odd(scene: Scene, distance: Array, followed: Bool, granted_px: Array) -> Bool:
        """Markers that deviate from their neighbours' prediction, and further than these do."""
        free = _ODD_WHEN_FREE * scene.free_share(followed) ** 3
        limit_px = max(_ODD, free) * granted_px
        odd = distance > limit_px
        if odd.any():
            nearby = scene.around.nearby(np.minimum(distance, scene.room_px / 4), followed)
            odd &= distance > limit_px + _ODDER_THAN_OTHERS * nearby
        return np.asarray(odd)

    def _told_by_sure(self, scene: Scene, displaced_px: Array, followed: Bool) -> Bool:
        """Sure markers, and outwards from them those whose displacement they tell."""
        around = scene.around
        trusted = followed & self._sure
        while (trusted != followed).any():
            off_px = displaced_px - around.fit(displaced_px, trusted.astype(np.float64))
            distance = np.hypot(off_px[:, 0], off_px[:, 1]) * around.reach_beyond(trusted) ** 2
            near = distance < _AGREEING * scene.room_px
            told = followed & ~trusted & near & (around.supporters(trusted) >= SUPPORT)
            if not told.any():
                break
            trusted = trusted | told
        return trusted
