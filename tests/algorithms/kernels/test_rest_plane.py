"""The kernels of rest plane agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import (
    AGREES,
    MM_PER_PX,
    both_ways,
    needs_kernels,
    press,
    seeds,
    several,
    shapes,
)

from tactile_core.algorithms.rest_surface import rest_plane

pytestmark = needs_kernels


@given(shape=shapes, seed=seeds, slope=st.floats(-0.08, 0.08))
@several
def test_rest_planes_agree(shape: tuple[int, int], seed: int, slope: float) -> None:
    noise = np.random.default_rng(seed).normal(0, 1e-3, shape)
    x_mm = np.arange(shape[1]) * MM_PER_PX
    height = np.asarray(press(shape, 0.3) + noise + slope * x_mm, np.float32)
    gx, gy = np.full(shape, slope, np.float32), np.zeros(shape, np.float32)

    def above(compiled: bool) -> np.ndarray:
        plane = rest_plane(height, gx, gy, mm_per_px=MM_PER_PX, compiled=compiled)
        return plane.removed_from(height, MM_PER_PX)

    fast, plain = both_ways(above)
    assert fast == pytest.approx(plain, abs=AGREES)
