"""Explanations of a frame that motion alone does not explain: several are tried."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import FEWEST_MARKERS, Scene
from tactile_core.algorithms.marker_tracking.nearest import nearest
from tactile_core.algorithms.marker_tracking.pairing import NOBODY

_FIRST_GATE = 0.45
_ALIKE = 0.3
_SEEDS = 3
_SMALLEST_SEED = 0.04
_SAME_SEED = 0.98
_GROWTH_ROUNDS, _TIDYING_ROUNDS = 15, 3
_SHIFTS = 3
_FARTHEST_SHIFT = 1.2
_BINS_PER_PITCH = 6
_CANDIDATES = 6
_TOO_CLOSE = 0.05
"""Explanations whose scores differ by less are equally good."""


def best_explanation(
    scene: Scene,
    last_px: Array,
    momentum_px: Array,
    rest_px: Array,
    sought: Bool,
    certain: Bool,
) -> Intp:
    """Explain a frame in several ways and take what the best ones have in common.

    The skin goes on as it moved, stands still, moves by a shift that many detections share, or
    is back at rest. Each is tried on every large piece of skin that it explains, and grows from
    there.

    Parameters
    ----------
    scene : Scene
    last_px : (N, 2) float64
        Where the markers were.
    momentum_px : (N, 2) float64
        By how much they should have moved on.
    rest_px : (N, 2) float64
        Where they are on the resting skin.
    sought : (N,) bool
        Markers whose last place is known well enough to look for them around it.
    certain : (N,) bool
        Markers that were seen in the last frame.

    Returns
    -------
    (N,) intp
        The detection of each marker; -1 where none is sure.
    """
    beginnings: list[Intp] = []
    explanations: list[tuple[float, Intp]] = []
    everyone = np.ones_like(sought)
    still = np.zeros_like(last_px)
    tried = [(last_px + momentum_px, still, sought), (last_px, still, sought)]
    tried += [(last_px, still + shift, sought) for shift in _shared_shifts(scene, last_px)]
    tried += [(rest_px, still, everyone)]
    for base_px, guess_px, seeking in tried:
        for seed in _seeds(scene, base_px, guess_px, seeking):
            if any((seed == other).mean() > _SAME_SEED for other in beginnings):
                continue
            beginnings.append(seed)
            owner = scene.grown(base_px, seed, seeking, rounds=_GROWTH_ROUNDS, relaxed=True)
            owner = scene.grown(base_px, owner, seeking, rounds=_TIDYING_ROUNDS, relaxed=False)
            owner = scene.sure(base_px, scene.whole(base_px, owner), certain)
            explanations.append((_score(scene, owner, last_px, momentum_px), owner))
    if not explanations:
        return np.full(len(last_px), NOBODY, np.intp)
    best, agreed = max(explanations, key=lambda each: each[0])
    agreed = agreed.copy()
    for score, owner in explanations:
        if score > best - _TOO_CLOSE:
            agreed[owner != agreed] = NOBODY
    return agreed


def _seeds(scene: Scene, base_px: Array, guess_px: Array, seeking: Bool) -> Iterator[Intp]:
    """Large pieces of skin whose markers, paired with what is nearest, move alike."""
    gate = np.where(seeking, _FIRST_GATE * scene.room_px, -1.0)
    owner = scene.paired(base_px + guess_px, gate)
    step, known = scene.moved(base_px, owner)
    if not known.any():
        return
    piece = scene.around.pieces(scene.around.agreeing(step, known, _ALIKE, 2.0))
    size = np.bincount(piece[known])
    for number in np.argsort(-size, kind="stable")[:_SEEDS]:
        if size[number] >= max(FEWEST_MARKERS, _SMALLEST_SEED * len(known)):
            yield np.where(known & (piece == number), owner, NOBODY)


def _score(scene: Scene, owner: Intp, last_px: Array, momentum_px: Array) -> float:
    """Many markers explained, by a small motion that is even, or that goes on evenly."""
    step, known = scene.moved(last_px, owner)
    if known.sum() < FEWEST_MARKERS:
        return -np.inf
    one, other = scene.around.pairs.T
    both = known[one] & known[other]
    cost = np.inf
    for surprise in (step, step - momentum_px):
        surprise = surprise / scene.around.pitch_px
        uneven = np.hypot(*(surprise[one] - surprise[other])[both].T)
        uneven = np.minimum((uneven / np.maximum(scene.around.apart[both], 0.7)) ** 2, 1)
        size = np.minimum(np.hypot(*surprise[known].T), 1.5)
        cost = min(cost, 0.25 * uneven.sum() / known.sum() + 0.3 * size.mean())
    return float(known.mean() - cost)


def _shared_shifts(scene: Scene, last_px: Array) -> list[Array]:
    """The (2,) shifts by which most detections lie beside some marker."""
    pitch = scene.around.pitch_px
    reach = _FARTHEST_SHIFT * pitch
    wanted = min(_CANDIDATES, len(scene.found_px))
    distance, index = nearest(last_px, scene.found_px, wanted, reach)
    marker, rank = np.nonzero(np.isfinite(distance))
    shift = scene.found_px[index[marker, rank]] - last_px[marker]
    bins = np.floor((shift + reach) / pitch * _BINS_PER_PITCH).astype(np.intp) + 1
    side = int(2 * _FARTHEST_SHIFT * _BINS_PER_PITCH) + 4
    votes = np.zeros((side, side))
    np.add.at(votes, (bins[:, 0], bins[:, 1]), 1)
    votes = np.asarray(cv2.blur(votes, (3, 3)))
    found = []
    for _ in range(_SHIFTS):
        peak = np.unravel_index(int(votes.argmax()), votes.shape)
        if votes[peak] <= 0:
            break
        found.append(shift[(np.abs(bins - np.array(peak)) <= 1).all(axis=1)].mean(axis=0))
        x, y = (slice(max(int(at) - 2, 0), int(at) + 3) for at in peak)
        votes[x, y] = 0
    return found
