"""The first attempt at a frame: match markers as if they had made a small, smooth step."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import Scene
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import (
    GROWTH,
    SMALL_MOTION,
    TRACKER,
    closest_of,
    pairings,
)

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
