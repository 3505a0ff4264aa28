"""Which detection is which pin: the assignment that moves all pins least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tactile_core.algorithms.arrays.types import Array, Bool
from tactile_core.algorithms.markers.neighbourhood import Neighbourhood

# [pitches] A pin that moves further is not found. Source: virtual presses; with 2, those that shear
# by a pitch are confused, with 4 so are pins beside one that is missing
_REACH_PITCHES = 3.0
# [spacings] Distance from where its neighbours predict a pin; beyond it another pin is nearer
_TOLERANCE_SPACINGS = 0.5
_ROUNDS = 10  # [count] It converges in fewer


def match_pins(around: Neighbourhood, reference_px: Array, found_px: Array) -> tuple[Array, Bool]:
    """Find each pin of the undeformed sensor among the detections of a frame.

    All pins of the sensor are always in view, so they are matched together and without earlier
    frames: with the least sum of squared displacements [1]_. A pin may also stay without a match.
    Neighbours then predict each pin, and the pins are matched again near their predictions, until
    nothing changes. This corrects the neighbours of a pin that was not detected.

    Parameters
    ----------
    around : Neighbourhood
        Of the reference.
    reference_px : (N, 2) float
        Pins of the undeformed sensor, x and y.
    found_px : (M, 2) float
        Detections, in any order; some may be missing or spurious.

    Returns
    -------
    px : (N, 2) float64
        Position of each pin; predicted by its neighbours if it is not seen.
    seen : (N,) bool

    References
    ----------
    .. [1] H. W. Kuhn, "The Hungarian method for the assignment problem", Naval Research Logistics
       Quarterly 2, 1955.
    """
    reference_px = np.asarray(reference_px, np.float64)
    found_px = np.asarray(found_px, np.float64).reshape(-1, 2)
    reach_px = np.full(len(reference_px), _REACH_PITCHES * around.pitch_px)
    tolerance_px = _TOLERANCE_SPACINGS * around.spacing_px
    owner = _assign(reference_px, found_px, reach_px)
    for _ in range(_ROUNDS):
        predicted_px = reference_px + _smooth(around, reference_px, found_px, owner)
        before, owner = owner, _assign(predicted_px, found_px, tolerance_px)
        if np.array_equal(owner, before):
            break
    seen = owner >= 0
    px = reference_px + _smooth(around, reference_px, found_px, owner)
    px[seen] = found_px[owner[seen]]
    return px, seen


def _assign(base_px: Array, found_px: Array, within_px: Array) -> NDArray[np.intp]:
    """Index of each pin's detection, or -1, by least squares; none costs ``within_px`` squared."""
    count, cost = len(base_px), np.square(within_px)[:, None]
    apart = np.square(base_px[:, None] - found_px).sum(axis=2)
    unseen = np.where(np.eye(count, dtype=np.bool_), cost, 1e6 * cost.max())
    pins, columns = linear_sum_assignment(np.hstack([apart, unseen]))
    owner = np.full(count, -1, np.intp)
    owner[pins] = np.where(columns < len(found_px), columns, -1)
    return owner


def _smooth(
    around: Neighbourhood, reference_px: Array, found_px: Array, owner: NDArray[np.intp]
) -> Array:
    """Displacement (N, 2) of each pin as a plane through its neighbours' predicts it."""
    moved_px, seen = np.zeros_like(reference_px), owner >= 0
    moved_px[seen] = found_px[owner[seen]] - reference_px[seen]
    return around.fit(moved_px, seen.astype(np.float64))
