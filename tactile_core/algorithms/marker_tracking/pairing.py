"""Markers and detections that are each other's nearest."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.types import Array, Intp
from tactile_core.algorithms.marker_tracking.nearest import nearest

NOBODY = -1


def paired(
    expected_px: Array, found_px: Array, within_px: Array, *, compiled: bool = False
) -> Intp:
    """Pair markers with detections, each the other's nearest.

    Parameters
    ----------
    expected_px : (N, 2) float64
        Where the markers should be.
    found_px : (M, 2) float64
        Detections.
    within_px : (N,) float64
        How far a marker may be from its detection; negative for one that seeks none.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Returns
    -------
    (N,) intp
        Index of each marker's detection, or -1.
    """
    result = np.full(len(expected_px), NOBODY, np.intp)
    seeking = np.flatnonzero(within_px >= 0)
    if not len(found_px) or not seeking.size:
        return result
    loops = kernels.chosen(compiled)
    if loops is not None:
        return np.asarray(loops.mutual_nearest(expected_px, found_px, within_px))
    distances, indices = nearest(expected_px[seeking], found_px, 1)
    distance, closest = distances[:, 0], indices[:, 0]
    favourite = np.full(len(found_px), NOBODY, np.intp)
    far_first = np.argsort(-distance, kind="stable")
    favourite[closest[far_first]] = far_first
    good = (distance <= within_px[seeking]) & (favourite[closest] == np.arange(len(seeking)))
    result[seeking[good]] = closest[good]
    return result
