"""Kernel of :mod:`tactile_core.algorithms.markers.spots`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from tactile_core.algorithms.kernels.options import LOOP


@njit(**LOOP)
def moments_of_labels(labels: Any, weight: Any, count: int) -> Any:
    """Sums of w, wx, wy, wxx, wxy and wyy of each label.

    Parameters
    ----------
    labels : (h, w) uint16
        0: of no spot.
    weight : (h, w) uint8
    count : int
        Labels, with 0.

    Returns
    -------
    (6, count) float64
    """
    sums = np.zeros((6, count))
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            of = labels[i, j]
            if of != 0 and of < count:
                w = np.float64(weight[i, j])
                x, y = np.float64(j), np.float64(i)
                sums[0, of] += w
                sums[1, of] += w * x
                sums[2, of] += w * y
                sums[3, of] += w * x * x
                sums[4, of] += w * x * y
                sums[5, of] += w * y * y
    return sums
