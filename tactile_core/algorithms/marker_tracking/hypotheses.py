"""Several hypotheses for a frame that a small, smooth motion does not explain."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import Scene
from tactile_core.algorithms.marker_tracking.nearest import nearest
from tactile_core.algorithms.marker_tracking.pairing import UNMATCHED
from tactile_core.algorithms.marker_tracking.parameters import GROWTH, HYPOTHESES


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
            owner = scene.unambiguous(base_px, scene.connected(base_px, owner), tracked)
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
    owner = scene.paired(base_px + guess_px, gate)
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
