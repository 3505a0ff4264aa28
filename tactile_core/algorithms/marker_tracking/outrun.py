"""Whether markers moved further between two frames than they can be followed."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.marker_tracking.parameters import GROWTH

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
