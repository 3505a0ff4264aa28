"""Quantiles of a few samples, without the many checks of numpy's, and a robust sigma."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def quantile(values: NDArray[Any], share: float) -> float:
    """Value below which this share of (N,) finite values lies, linear between neighbours."""
    place = share * (len(values) - 1)
    below = int(place)
    above = min(below + 1, len(values) - 1)
    ordered = np.partition(values, (below, above))
    low, high = float(ordered[below]), float(ordered[above])
    return low + (place - below) * (high - low)


def sigma_of(residuals: NDArray[Any]) -> float:
    """Standard deviation of (N,) normal residuals about 0; what a few outliers are is ignored."""
    return 1.4826 * float(np.median(np.abs(residuals)))
