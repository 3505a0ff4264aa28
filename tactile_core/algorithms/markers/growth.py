"""Matches of one frame: pairs, planes through their neighbours, growth, and hypotheses."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from tactile_core.algorithms.arrays.regression import sigma_of
from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.markers.neighbourhood import (
    GROWTH,
    UNMATCHED,
    Neighbourhood,
    nearest,
    pair_nearest,
)


@dataclass(frozen=True, eq=False)
class Scene:
    """The detections of one frame, and what is known of the markers before it.

    Matches are an (N,) array ``owner``: the index of each marker's detection, or -1.

    Attributes
    ----------
    around : Neighbourhood
    found_px : (M, 2) float64
        Detections.
    in_view : (N,) bool
        Markers that the image can show.
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
    uncertainty_px: Array

    def match_step(self, base_px: Array, searched: Bool) -> Intp | None:
        """Match the markers near their predictions; None where a small step explains too little.

        That is where many are outliers, or are torn off from the others.

        Parameters
        ----------
        base_px : (N, 2) float64
            Predicted positions.
        searched : (N,) bool
            Markers that may be matched.
        """
        owner = self.pair_markers(base_px, searched)
        if self.is_smooth(base_px, owner):
            return owner
        grown = self.grow(base_px, owner, searched)
        paired, few = owner >= 0, 3  # [markers] with more outliers other hypotheses are tried
        share = 0.12 * np.count_nonzero(paired)  # [share] among many markers
        if np.count_nonzero(paired & (grown != owner)) > max(few, share):
            return None
        whole = self.keep_largest_region(base_px, grown)
        return None if np.count_nonzero(whole != grown) > few else whole

    def is_smooth(self, base_px: Array, owner: Intp) -> bool:
        """Whether all markers are matched, and close to where their neighbours predict them.

        Growth leaves such matches as they are; they are most frequent.
        """
        if (owner < 0).any():
            return False
        step_px = self.found_px.take(owner, axis=0) - base_px
        x, y = (step_px - self.around.fit(step_px, np.ones(len(owner)))).T
        return bool((np.hypot(x, y) <= GROWTH.min_tolerance * self.around.spacing_px).all())

    def pair_markers(self, base_px: Array, searched: Bool) -> Intp:
        """Match each marker that is searched for with its mutually nearest detection."""
        gate_px = 0.5 * self.around.spacing_px  # beyond half a spacing another marker is closer
        return pair_nearest(base_px, self.found_px, np.where(searched, gate_px, -1.0))

    def measure_steps(self, base_px: Array, owner: Intp) -> tuple[Array, Bool]:
        """Step (N, 2) of each marker from ``base_px``, 0 if unmatched, and which are matched."""
        matched = owner >= 0
        step_px = np.zeros_like(base_px)
        step_px[matched] = self.found_px[owner[matched]] - base_px[matched]
        return step_px, matched

    def grow(self, base_px: Array, owner: Intp, searched: Bool, *, relaxed: bool = False) -> Intp:
        """Drop outliers, and add markers where their neighbours predict them, until convergence.

        Parameters
        ----------
        base_px : (N, 2) float64
            Positions from which the steps are smooth.
        owner : (N,) intp
            Matches to start from.
        searched : (N,) bool
            Markers that may be added.
        relaxed : bool
            Use the full gate for new markers; the tolerance rejects wrong ones in the next round.
        """
        around = self.around
        gate_px = GROWTH.gate_spacings * around.spacing_px
        for _ in range(15):  # [rounds] it converges in fewer
            step_px, matched = self.measure_steps(base_px, owner)
            expected_px = around.fit(step_px, matched.astype(np.float64))
            residual_px = np.hypot(*(step_px - expected_px).T)
            tolerance_px = self.measure_tolerance(residual_px, matched)
            kept = np.where(residual_px > tolerance_px, UNMATCHED, owner)
            supported = around.supporters(kept >= 0) >= GROWTH.min_neighbours
            wanted = searched & (kept < 0) & supported
            reach_px = gate_px if relaxed else tolerance_px
            grown = self._add(kept, base_px + expected_px, np.where(wanted, reach_px, -1.0))
            if np.array_equal(grown, owner):
                break
            owner = grown
        return owner

    def _add(self, owner: Intp, expected_px: Array, within_px: Array) -> Intp:
        """Match markers with the detections that no other marker owns."""
        free = np.ones(len(self.found_px), np.bool_)
        free[owner[owner >= 0]] = False
        left = np.append(np.flatnonzero(free), UNMATCHED)
        new = pair_nearest(expected_px, self.found_px[free], within_px)
        return np.where(new >= 0, left[new], owner)

    def measure_tolerance(self, residual_px: Array, matched: Bool) -> Array:
        """Residual (N,) from its neighbours' prediction above which a marker is an outlier, px.

        It grows with the residuals of all others, with those nearby, and with the uncertainty of
        the marker's position. It is wider while there are few missing markers or few spurious
        detections, since a mismatch needs both.
        """
        left_over = max(len(self.found_px) - int(np.count_nonzero(matched)), 0)
        missing = int(np.count_nonzero(self.in_view & ~matched))
        clutter_free = GROWTH.gate_spacings / (1 + missing * left_over / len(matched))
        spacing_px = self.around.spacing_px
        nearby_px = self.around.nearby(residual_px, matched)
        noise_px = sigma_of(residual_px[matched]) if matched.any() else 0.0
        least_px = max(clutter_free, GROWTH.min_tolerance) * spacing_px
        # [ratio] to the noise of all residuals, and to the mean nearby
        allowed_px = 2.5 * np.maximum(nearby_px, noise_px)
        allowed_px = np.maximum(allowed_px, self.uncertainty_px)
        return np.clip(allowed_px, least_px, GROWTH.gate_spacings * spacing_px)

    def keep_largest_region(self, base_px: Array, owner: Intp) -> Intp:
        """Drop regions whose steps are torn off from those of the largest region."""
        step_px, matched = self.measure_steps(base_px, owner)
        region = self.around.find_regions(step_px, matched)
        largest = np.bincount(region[matched], minlength=1).argmax()
        return np.where(matched & (region == largest), owner, UNMATCHED)

    def match_best(self, hypotheses: list[tuple[Array, Bool]]) -> Intp:
        """Match under several hypotheses, and return the best matches.

        Each hypothesis is the positions (N, 2) from which steps are smooth, and the markers (N,)
        that are searched for. It starts from its largest region of coherent steps.
        """
        matches = []
        for base_px, searched in hypotheses:
            seed = self.keep_largest_region(base_px, self.pair_markers(base_px, searched))
            owner = self.grow(base_px, seed, searched, relaxed=True)
            matches.append((base_px, self.keep_largest_region(base_px, owner)))
        return max(matches, key=lambda match: self.score_matches(*match))[1]

    def score_matches(self, base_px: Array, owner: Intp) -> float:
        """Share of the markers that are matched, less the cost of steps unlike the neighbours'."""
        step_px, matched = self.measure_steps(base_px, owner)
        uneven = self.around.measure_unevenness(step_px) ** 2
        both = matched[:, None] & matched[self.around.index]
        # [share of the markers] 0.06 to 0.18 track virtual strokes alike; without it, one in five
        # fast ones swaps markers
        cost = 0.12 * np.minimum(uneven, 1)[both].sum() / len(matched)
        return float(matched.mean() - cost)

    def find_shift(self, last_px: Array) -> Array:
        """The shift (2,) by which most markers find a detection, by a smoothed histogram."""
        # [pitches] Virtual strokes move by up to two thirds of a pitch per frame
        pitch_px, reach = self.around.pitch_px, 1.2
        asked = min(6, len(self.found_px))  # [shifts]
        distance_px, index = nearest(last_px, self.found_px, asked, reach * pitch_px)
        marker, rank = np.isfinite(distance_px).nonzero()
        shift_px = self.found_px[index[marker, rank]] - last_px[marker]
        if not len(shift_px):
            return np.zeros(2)
        bins = np.floor((shift_px / pitch_px + reach) * GROWTH.bins_per_pitch).astype(np.intp) + 1
        votes = np.zeros((int(2 * reach * GROWTH.bins_per_pitch) + 3,) * 2)
        np.add.at(votes, (bins[:, 0], bins[:, 1]), 1)
        votes = np.asarray(cv2.blur(votes, (3, 3)))
        most = np.unravel_index(int(votes.argmax()), votes.shape)
        return np.asarray(shift_px[(np.abs(bins - most) <= 1).all(axis=1)].mean(axis=0))


# Pitches: half a pitch, where the next marker is as near, less the error of a position.
_HALF = 0.45

_FAST = 0.15  # Pitches: markers that vanish while others move by less are covered, not outrun


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
    # [share of the markers] No object covers as many from one frame to the next
    many = vanished >= max(GROWTH.min_markers, 0.05 * len(seen))
    return fast if fast >= _HALF or (many and fast >= _FAST) else 0.0
