"""Region growing: each marker is looked for where its known neighbours expect it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.quantile import sigma_of
from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.nearest import nearest
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import NOBODY, paired

FEWEST_MARKERS = 4
"""With fewer there is no telling which is which."""

SUPPORT = 3
"""So many neighbours are needed to say where a marker is."""

_TEAR = 0.45
"""Neighbours that part by more pitches from one frame to the next belong to two interpretations."""

_TEAR_BEYOND = 1.3
_OPEN_GATE = 0.3
BEYOND_DOUBT = 0.1
"""Of the room around a marker: nearer to what its neighbours let expect, it is itself."""

_RIVALRY, _RIVALRY_OF_LOST = 0.5, 0.3
_WIDEST, _NARROWEST = 0.3, 0.06
_FREE_FLOOR = 0.3
"""How far off a marker may be, in pitches, when there is nothing else to be taken for it."""


@dataclass(frozen=True, eq=False)
class Scene:
    """One frame's detections, to be explained from where the markers are thought to be.

    Attributes
    ----------
    around : Neighbourhood
    found_px : (M, 2) float64
        Detections.
    in_view : (N,) bool
        Markers that the image could show.
    room_px : (N,) float64
        Distance of the nearest other marker, on the resting skin or now, whichever is less.
    doubt_px : (N,) float64
        How far a marker may be from where it is thought to be.
    """

    around: Neighbourhood
    found_px: Array
    in_view: Bool
    room_px: Array
    doubt_px: Array

    def paired(self, expected_px: Array, within_px: Array, found_px: Array | None = None) -> Intp:
        """Pair markers with all detections, or with those given; see :func:`paired`."""
        found_px = self.found_px if found_px is None else found_px
        return paired(expected_px, found_px, within_px, compiled=self.around.compiled)

    def moved(self, base_px: Array, owner: Intp) -> tuple[Array, Bool]:
        """How far each marker is from ``base_px``, 0 where unknown, and which are known."""
        known = owner >= 0
        if known.all():
            return self.found_px.take(owner, axis=0) - base_px, known
        step = np.zeros_like(base_px)
        step[known] = self.found_px[owner[known]] - base_px[known]
        return step, known

    def tolerance(self, distance: Array, known: Bool) -> Array:
        """How far each marker may deviate from what its neighbours let expect, (N,) px.

        As far as others around it do, or as its place is doubtful, and further while no detections
        are left over: where there are many impostors and many gaps, one falls into a gap the more
        easily the wider it is.
        """
        around = self.around
        room = self.room_px
        typical = sigma_of(distance[known]) if known.any() else 0.0
        nearby = around.nearby(np.minimum(distance, room / 4), known)
        floor = self.free_share(known)
        allowed = np.maximum(3.5 * typical, 2.5 * nearby) + 0.02 * around.pitch_px
        allowed = np.maximum(allowed, self.doubt_px)
        return np.clip(allowed, max(floor, _NARROWEST) * room, _WIDEST * room)

    def free_share(self, known: Bool) -> float:
        """Of the room around a marker: so far off it may be with so many gaps and impostors."""
        left_over = max(len(self.found_px) - int(np.count_nonzero(known)), 0)
        missing = int(np.count_nonzero(self.in_view & ~known))
        return _FREE_FLOOR / (1 + missing * left_over / len(known))

    def grown(
        self, base_px: Array, owner: Intp, sought: Bool, *, rounds: int, relaxed: bool
    ) -> Intp:
        """Add markers beside known ones, and drop those that do not fit, until nothing changes.

        Parameters
        ----------
        base_px : (N, 2) float64
            Where each marker was, or was thought to be: motion from there is smooth.
        owner : (N,) intp
            Detection of each marker that is known, -1 of the others.
        sought : (N,) bool
            Markers that may be added.
        rounds : int
            At most.
        relaxed : bool
            Use a wide gate for new markers; the tolerance rejects wrong ones in the next round.
        """
        around = self.around
        for _ in range(rounds):
            step, known = self.moved(base_px, owner)
            if known.sum() < FEWEST_MARKERS:
                return np.full_like(owner, NOBODY)
            expected, distance = around.deviation(step, known, rounds=1)
            tolerance = self.tolerance(distance, known)
            misfit = known & (distance > tolerance) & (around.supporters(known) >= SUPPORT)
            kept = np.where(misfit, NOBODY, owner)
            free = np.ones(len(self.found_px), np.bool_)
            free[kept[kept >= 0]] = False
            left = np.flatnonzero(free)
            gate = _OPEN_GATE * self.room_px
            if not relaxed:
                gate = np.minimum(gate, tolerance)
            wanted = sought & (kept < 0) & (around.supporters(kept >= 0) >= SUPPORT)
            new = self.paired(base_px + expected, np.where(wanted, gate, -1.0), self.found_px[left])
            added = new >= 0
            kept[added] = left[new[added]]
            if np.array_equal(kept, owner):
                break
            owner = kept
        return owner

    def sure(self, base_px: Array, owner: Intp, fresh: Bool) -> Intp:
        """Drop the markers whose detection might as well show another one.

        A marker that lies off what its neighbours let expect has to lie much nearer to it than its
        detection lies to any other marker's expected place, even that of one that is known.
        """
        step, known = self.moved(base_px, owner)
        expected, distance = self.around.deviation(step, known, rounds=1)
        doubted = np.flatnonzero(known & (~fresh | (distance > BEYOND_DOUBT * self.room_px)))
        if not doubted.size:
            return owner
        rival, whose = nearest(self.found_px[owner[doubted]], base_px + expected, 2)
        nearest_rival = np.where(whose[:, 0] == doubted, rival[:, 1], rival[:, 0])
        granted = np.where(fresh[doubted], _RIVALRY, _RIVALRY_OF_LOST)
        unsure = doubted[distance[doubted] > granted * nearest_rival]
        owner = owner.copy()
        owner[unsure] = NOBODY
        return owner

    def whole(self, base_px: Array, owner: Intp) -> Intp:
        """Keep the largest piece of skin that holds together; what is torn off it is not sure."""
        step, known = self.moved(base_px, owner)
        if not known.any():
            return owner
        bonds = self.around.agreeing(step, known, _TEAR, _TEAR_BEYOND)
        one, other = self.around.pairs.T
        if (
            np.array_equal(bonds, known[one] & known[other])
            and (self.around.supporters(known)[known] >= SUPPORT).all()
        ):
            return owner
        piece = self.around.pieces(bonds)
        largest = np.bincount(piece[known]).argmax()
        return np.where(known & (piece == largest), owner, NOBODY)
