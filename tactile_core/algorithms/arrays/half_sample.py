"""The narrowest interval that holds half of some values: contacts and faults fall outside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array


def narrowest(ordered: Array, count: int) -> tuple[NDArray[np.intp], Array]:
    """Where the narrowest interval that holds so many values begins, and its length.

    Parameters
    ----------
    ordered : (..., N)
        Sorted along the last axis.
    count : int
        Of values in the interval, at most N.

    Returns
    -------
    first, length : (...)
    """
    last = ordered.shape[-1] - count
    lengths = ordered[..., count - 1 :] - ordered[..., : last + 1]
    return lengths.argmin(axis=-1), lengths.min(axis=-1)
