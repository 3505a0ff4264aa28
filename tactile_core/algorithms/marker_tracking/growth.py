"""Growth: markers matched from a coherent region outwards; small motions, which need none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.regression import sigma_of
from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import (
    GROWTH,
    SMALL_MOTION,
    TRACKER,
    UNMATCHED,
    closest_of,
    nearest,
    pair_nearest,
    pairings,
)


@dataclass(frozen=True, eq=False)
class Scene:
    """The detections of one frame, and the state of the markers before it.

    Matches are an (N,) array ``owner``: the index of each marker's detection, or -1.

    Attributes
    ----------
    around : Neighbourhood
    found_px : (M, 2) float64
        Detections.
    in_view : (N,) bool
        Markers that the image can show.
    spacing_px : (N,) float64
        Distance to the nearest other marker, in the reference or now, whichever is shorter.
    uncertainty_px : (N,) float64
        Uncertainty of the position of each marker.

    References
    ----------
    .. [1] R. Adams and L. Bischof, "Seeded region growing", IEEE Transactions on Pattern Analysis
       and Machine Intelligence 16(6), 1994.
    """

    around: Neighbourhood
    found_px: Array
    in_view: Bool
    spacing_px: Array
    uncertainty_px: Array

    def pair_markers(
        self, expected_px: Array, within_px: Array, found_px: Array | None = None
    ) -> Intp:
        """Match markers with all detections, or with those given; see :func:`pair_nearest`."""
        found_px = self.found_px if found_px is None else found_px
        return pair_nearest(expected_px, found_px, within_px)

    def steps(self, base_px: Array, owner: Intp) -> tuple[Array, Bool]:
        """Step (N, 2) of each marker from ``base_px``, 0 if unmatched, and which are matched."""
        known = owner >= 0
        if known.all():
            return self.found_px.take(owner, axis=0) - base_px, known
        step = np.zeros_like(base_px)
        step[known] = self.found_px[owner[known]] - base_px[known]
        return step, known

    def tolerance(self, distance: Array, known: Bool) -> Array:
        """Largest residual (N,) of each marker from its neighbours' prediction, px.

        It grows with the residuals of the others, with those nearby, and with the uncertainty of
        the marker's position. It is wider while there are few missing markers or few spurious
        detections, since a mismatch needs both.
        """
        around = self.around
        spacing = self.spacing_px
        typical = sigma_of(distance[known]) if known.any() else 0.0
        nearby = around.nearby(np.minimum(distance, GROWTH.residual_cap * spacing), known)
        floor = self.clutter_tolerance(known)
        allowed = np.maximum(GROWTH.typical_residuals * typical, GROWTH.nearby_residuals * nearby)
        allowed = allowed + GROWTH.slack_pitches * around.pitch_px
        allowed = np.maximum(allowed, self.uncertainty_px)
        least = max(floor, GROWTH.min_tolerance) * spacing
        return np.clip(allowed, least, GROWTH.max_tolerance * spacing)

    def clutter_tolerance(self, known: Bool) -> float:
        """Lower bound of the tolerance in spacings, given the missing and spurious detections."""
        left_over = max(len(self.found_px) - int(np.count_nonzero(known)), 0)
        missing = int(np.count_nonzero(self.in_view & ~known))
        return GROWTH.clutter_free_tolerance / (1 + missing * left_over / len(known))

    def grow(
        self, base_px: Array, owner: Intp, searched: Bool, *, rounds: int, relaxed: bool
    ) -> Intp:
        """Grow a region of matches: add markers next to it and drop outliers until convergence.

        Parameters
        ----------
        base_px : (N, 2) float64
            Positions in the previous frame, from which the steps are smooth.
        owner : (N,) intp
            Matches to start from.
        searched : (N,) bool
            Markers that may be added.
        rounds : int
            Maximum number of rounds.
        relaxed : bool
            Use the full gate for new markers; the tolerance rejects wrong ones in the next round.

        Returns
        -------
        (N,) intp
        """
        around, support = self.around, GROWTH.min_neighbours
        for _ in range(rounds):
            step, known = self.steps(base_px, owner)
            if known.sum() < GROWTH.min_markers:
                return np.full_like(owner, UNMATCHED)
            expected, distance = around.deviation(step, known, rounds=1)
            tolerance = self.tolerance(distance, known)
            misfit = known & (distance > tolerance) & (around.supporters(known) >= support)
            kept = np.where(misfit, UNMATCHED, owner)
            free = np.ones(len(self.found_px), np.bool_)
            free[kept[kept >= 0]] = False
            left = np.flatnonzero(free)
            gate = GROWTH.gate_spacings * self.spacing_px
            if not relaxed:
                gate = np.minimum(gate, tolerance)
            wanted = searched & (kept < 0) & (around.supporters(kept >= 0) >= support)
            new = self.pair_markers(
                base_px + expected, np.where(wanted, gate, -1.0), self.found_px[left]
            )
            added = new >= 0
            kept[added] = left[new[added]]
            if np.array_equal(kept, owner):
                break
            owner = kept
        return owner

    def unambiguous(self, base_px: Array, owner: Intp, tracked: Bool) -> Intp:
        """Drop markers whose detection may belong to another marker.

        A detection that is off its marker's prediction must be much closer to it than to the
        prediction of any other marker, matched or not. ``tracked``, (N,) bool, are the markers
        that were matched in the previous frame; the others must be closer still.
        """
        step, known = self.steps(base_px, owner)
        expected, distance = self.around.deviation(step, known, rounds=1)
        off_prediction = distance > GROWTH.accepted_spacings * self.spacing_px
        doubtful = np.flatnonzero(known & (~tracked | off_prediction))
        if not doubtful.size:
            return owner
        rival, whose = nearest(self.found_px[owner[doubtful]], base_px + expected, 2)
        nearest_rival = np.where(whose[:, 0] == doubtful, rival[:, 1], rival[:, 0])
        ratio = np.where(tracked[doubtful], GROWTH.ambiguity_ratio, GROWTH.ambiguity_ratio_lost)
        ambiguous = doubtful[distance[doubtful] > ratio * nearest_rival]
        owner = owner.copy()
        owner[ambiguous] = UNMATCHED
        return owner

    def keep_largest_region(self, base_px: Array, owner: Intp) -> Intp:
        """Keep the largest region of coherent steps; a region that is torn off is ambiguous."""
        step, known = self.steps(base_px, owner)
        if not known.any():
            return owner
        bonds = self.around.coherent(step, known, GROWTH.tear_pitches, GROWTH.tear_reach_pitches)
        one, other = self.around.pairs.T
        if (
            np.array_equal(bonds, known[one] & known[other])
            and (self.around.supporters(known)[known] >= GROWTH.min_neighbours).all()
        ):
            return owner
        region = self.around.components(bonds)
        largest = np.bincount(region[known]).argmax()
        return np.where(known & (region == largest), owner, UNMATCHED)


# Pitches: half a pitch, where the next marker is as near, less the error of a position.
_HALF = 0.45

_FAST = 0.15  # Pitches: markers that vanish while others move by less are covered, not outrun

_VANISHED = 0.05  # Share of the markers that no object covers from one frame to the next


def outrun_pitches(step_px: Array, seen_before: Bool, seen: Bool, pitch_px: float) -> float:
    """Return by how many pitches markers moved at least, if that was too far; else 0.

    A printed marker looks like the next one. One that moves by half of their pitch is as near to
    its neighbour's last place as to its own, and tracking takes the nearer one or none: then the
    steps that are found stay below half a pitch, but many markers vanish at once.

    Parameters
    ----------
    step_px : (N, 2) float64
        Step of each marker since the frame before.
    seen_before, seen : (N,) bool
        Markers that were seen in the frame before, and now.
    pitch_px : float
    """
    both = seen_before & seen
    if np.count_nonzero(both) < GROWTH.min_markers:
        return 0.0
    pitches = np.sort(np.hypot(*step_px[both].T)) / pitch_px
    # a region, because a single marker may be a wrong match
    fast = float(pitches[-GROWTH.min_markers])
    vanished = np.count_nonzero(seen_before & ~seen)
    many = vanished >= max(GROWTH.min_markers, _VANISHED * len(seen))
    return fast if fast >= _HALF or (many and fast >= _FAST) else 0.0


# Distances of markers and detections up to which all of them are faster than a k-d tree.
_MOST_DISTANCES = 250_000


def match_markers(
    scene: Scene, last_px: Array, momentum_px: Array, searched: Bool
) -> tuple[Intp, Bool]:
    """Match each marker with the detection that is mutually nearest to its prediction.

    Parameters
    ----------
    scene : Scene
    last_px : (N, 2) float64
        Positions in the previous frame.
    momentum_px : (N, 2) float64
        Predicted steps.
    searched : (N,) bool
        Markers to match.

    Returns
    -------
    owner : (N,) intp
        The detection of each marker, or -1.
    small, smooth : (2,) bool
        ``small``: enough markers are matched, and nearly all of them to the same detection with
        and without momentum. ``smooth``: in addition, each is close to its neighbours' prediction
        and none can be added.
    """
    gate = np.where(searched, SMALL_MOTION.gate_spacings * scene.spacing_px, -1.0)
    enough = max(GROWTH.min_markers, SMALL_MOTION.min_share * np.count_nonzero(searched))
    base_px = last_px + momentum_px
    owner, without_momentum = pairings(np.stack([base_px, last_px]), scene.found_px, gate)
    both = (without_momentum >= 0) & (owner >= 0)
    misfits = np.count_nonzero((without_momentum != owner) & both)
    step, known = scene.steps(base_px, owner)
    few = misfits <= SMALL_MOTION.max_misfits
    small = bool(few and np.count_nonzero(known) >= enough)
    return owner, np.array([small, small and _smooth(scene, step, known)])


def steady(
    around: Neighbourhood, last_px: Array, momentum_px: Array, found_px: Array
) -> tuple[Array, Array] | None:
    """Follow markers of which none was lost, if all of them make a small, smooth step again.

    It is the outcome of :func:`match_markers` when every marker is searched, matched and smooth,
    which is most often the case and found out many times faster.

    Parameters
    ----------
    around : Neighbourhood
    last_px, momentum_px, found_px
        As for :func:`match_markers`.

    Returns
    -------
    px, momentum_px : (N, 2) float64
        Present positions, and predicted next steps. None if not all markers do, and where it
        takes a closer look to say.
    """
    count, base_px = len(last_px), last_px + momentum_px
    if len(found_px) < count or len(found_px) * count > _MOST_DISTANCES:
        return None
    expected_px = np.concatenate([base_px, last_px])
    closest = closest_of(expected_px, found_px)
    step_px = found_px.take(closest, axis=0) - expected_px
    x, y = step_px.T
    spacing_px = around.spacing_px(last_px)
    far = np.sqrt(x * x + y * y).reshape(2, count) > SMALL_MOTION.gate_spacings * spacing_px
    owner, without_momentum = closest[:count], closest[count:]
    if far[0].any() or np.bincount(owner).max() > 1:
        return None
    misfits = np.count_nonzero((without_momentum != owner) & ~far[1])
    step_px = step_px[:count]
    x, y = (step_px - around.plane(step_px)).T
    limit_px = GROWTH.accepted_spacings * spacing_px
    if misfits > SMALL_MOTION.max_misfits or (x * x + y * y > limit_px * limit_px).any():
        return None
    px = found_px.take(owner, axis=0)
    return px, TRACKER.momentum * (px - last_px)


def _smooth(scene: Scene, step: Array, known: Bool) -> bool:
    around = scene.around
    count = np.count_nonzero(known)
    if count < min(len(known), len(scene.found_px)):
        return False
    expected = around.fit(step, known.astype(np.float64))
    residual = np.hypot(step[:, 0] - expected[:, 0], step[:, 1] - expected[:, 1])
    if (residual > GROWTH.accepted_spacings * scene.spacing_px)[known].any():
        return False
    if count == len(known):
        return True
    return bool((around.supporters(known)[known] >= GROWTH.min_neighbours).all())
