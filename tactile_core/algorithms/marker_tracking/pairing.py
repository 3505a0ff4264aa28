"""Mutual nearest neighbours of predicted and detected markers."""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms import kernels
from tactile_core.algorithms.arrays.types import Array, Intp
from tactile_core.algorithms.marker_tracking.nearest import nearest

UNMATCHED = -1
"""Index of the detection of a marker that has none."""


def paired(
    expected_px: Array, found_px: Array, within_px: Array, *, compiled: bool = False
) -> Intp:
    """Match markers with detections that are mutually nearest.

    Parameters
    ----------
    expected_px : (N, 2) float64
        Predicted positions of the markers.
    found_px : (M, 2) float64
        Detections.
    within_px : (N,) float64
        Search radius of each marker; negative for a marker that is not matched.
    compiled : bool
        Whether to use :mod:`tactile_core.algorithms.kernels`.

    Returns
    -------
    (N,) intp
        Index of each marker's detection, or -1.
    """
    result = np.full(len(expected_px), UNMATCHED, np.intp)
    searching = np.flatnonzero(within_px >= 0)
    if not len(found_px) or not searching.size:
        return result
    loops = kernels.chosen(compiled)
    if loops is not None:
        return np.asarray(loops.mutual_nearest(expected_px, found_px, within_px))
    distances, indices = nearest(expected_px[searching], found_px, 1)
    distance, closest = distances[:, 0], indices[:, 0]
    nearest_marker = np.full(len(found_px), UNMATCHED, np.intp)
    far_first = np.argsort(-distance, kind="stable")
    nearest_marker[closest[far_first]] = far_first
    mutual = nearest_marker[closest] == np.arange(len(searching))
    good = (distance <= within_px[searching]) & mutual
    result[searching[good]] = closest[good]
    return result
