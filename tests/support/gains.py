"""By how much measured slopes are steeper than true ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

WELL_INSIDE = 0.7
"""Of a contact's radius: smoothing brings in no light from beyond its border."""

MOST = 0.02
"""By which a gain may differ from 1."""


def gains(measured: NDArray[Any], true: NDArray[Any]) -> NDArray[np.float64]:
    """(2,) regression of measured on true slopes, (N, 2), through the origin: along x, along y."""
    measured, true = measured.astype(np.float64), true.astype(np.float64)
    return np.asarray((measured * true).sum(0) / (true * true).sum(0))
