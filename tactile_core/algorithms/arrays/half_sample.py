"""Narrowest interval that holds a part of the values, robust to contacts and other outliers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array


def narrowest(ordered: Array, count: int) -> tuple[NDArray[np.intp], Array]:
    """Find the narrowest interval that holds ``count`` values.

    With half of the values it is the shortest half, whose mean is the shorth [1]_.

    Parameters
    ----------
    ordered : (..., N)
        Values, sorted along the last axis.
    count : int
        Number of values in the interval, at most N.

    Returns
    -------
    first : (...) int
        Index of the first value in the interval.
    length : (...)
        Length of the interval.

    References
    ----------
    .. [1] D. F. Andrews et al., "Robust Estimates of Location: Survey and Advances", Princeton
       University Press, 1972.
    """
    last = ordered.shape[-1] - count
    lengths = ordered[..., count - 1 :] - ordered[..., : last + 1]
    return lengths.argmin(axis=-1), lengths.min(axis=-1)


def shorths(rows: Array) -> Array:
    """Return the mean of the shortest interval that holds half of each row of (K, N), (K,)."""
    ordered = np.sort(rows, axis=1)
    half = ordered.shape[1] // 2
    first, _ = narrowest(ordered, half + 1)
    return np.array(
        [row[i : i + half].sum() / half for row, i in zip(ordered, first.tolist(), strict=True)],
        np.float32,
    )
