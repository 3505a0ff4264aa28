"""What tests of compiled kernels share: numpy is the definition, with which kernels agree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st

from tactile_core.algorithms import kernels

MM_PER_PX = 0.05
AGREES = 1e-5

needs_kernels = pytest.mark.skipif(
    kernels.load() is None, reason="numba is not installed, or TACTILE_FAST is 0"
)
seeds = st.integers(0, 2**32 - 1)
shapes = st.tuples(st.integers(1, 40), st.integers(1, 40))
several = settings(max_examples=15)


def both_ways(function: Callable[[bool], Any]) -> tuple[Any, Any]:
    """Results of a function with the kernels and without."""
    return function(True), function(False)


def press(shape: tuple[int, int], radius_mm: float = 1.5) -> np.ndarray:
    """Height map with a spherical cap of 0.4 mm on the undeformed surface."""
    y, x = np.mgrid[: shape[0], : shape[1]] * MM_PER_PX
    far = np.square(x - x.mean()) + np.square(y - y.mean())
    return np.asarray(np.maximum(0, 0.4 * (1 - far / radius_mm**2)), np.float32)
