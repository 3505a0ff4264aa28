"""The first look at a frame: markers and detections as a small, even step would have them."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Intp
from tactile_core.algorithms.marker_tracking.growth import (
    BEYOND_DOUBT,
    FEWEST_MARKERS,
    SUPPORT,
    Scene,
)

FEW_MISFITS = 3
_GATE = 0.5
_ENOUGH = 0.3


def begun(scene: Scene, last_px: Array, momentum_px: Array, sought: Bool) -> tuple[Intp, Bool]:
    """Pair each marker with the detection that is mutually nearest.

    Parameters
    ----------
    scene : Scene
    last_px : (N, 2) float64
        Where the markers were.
    momentum_px : (N, 2) float64
        By how much they should have moved on.
    sought : (N,) bool

    Returns
    -------
    owner : (N,) intp
        The detection of each marker, or -1.
    small, calm : (2,) bool
        Whether enough markers are paired, and alike with momentum and without; and whether,
        besides, each is where its neighbours have it and none could be added.
    """
    base_px = last_px + momentum_px
    gate = np.where(sought, _GATE * scene.room_px, -1.0)
    enough = max(FEWEST_MARKERS, _ENOUGH * np.count_nonzero(sought))
    owner = scene.paired(base_px, gate)
    still = scene.paired(last_px, gate)
    misfits = np.count_nonzero((still != owner) & (still >= 0) & (owner >= 0))
    step, known = scene.moved(base_px, owner)
    small = bool(misfits <= FEW_MISFITS and np.count_nonzero(known) >= enough)
    return owner, np.array([small, small and _calm(scene, step, known)])


def _calm(scene: Scene, step: Array, known: Bool) -> bool:
    around = scene.around
    count = np.count_nonzero(known)
    if count < min(len(known), len(scene.found_px)):
        return False
    expected = around.fit(step, known.astype(np.float64))
    off = np.hypot(step[:, 0] - expected[:, 0], step[:, 1] - expected[:, 1])
    if (off > BEYOND_DOUBT * scene.room_px)[known].any():
        return False
    return count == len(known) or bool((around.supporters(known)[known] >= SUPPORT).all())
