"""Gain of measured slopes relative to the true ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

WELL_INSIDE = 0.7
"""Share of a contact's radius within which smoothing mixes in no light from outside it."""

MOST = 0.02
"""Tolerance of a gain of 1."""


def gains(measured: NDArray[Any], true: NDArray[Any]) -> NDArray[np.float64]:
    """(2,) regression of measured on true slopes, (N, 2), through the origin: along x, along y."""
    measured, true = measured.astype(np.float64), true.astype(np.float64)
    return np.asarray((measured * true).sum(0) / (true * true).sum(0))
