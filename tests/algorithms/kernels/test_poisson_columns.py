"""The kernels of the height, column by column, agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
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

from tactile_core.algorithms.poisson import PoissonSolver

pytestmark = needs_kernels


@given(shape=shapes, seed=seeds)
@several
def test_heights_agree_on_images_of_any_size(shape: tuple[int, int], seed: int) -> None:
    gx, gy = np.random.default_rng(seed).standard_normal((2, *shape)).astype(np.float32)
    fast, plain = both_ways(
        lambda compiled: PoissonSolver(shape, mm_per_px=MM_PER_PX, compiled=compiled).solve(gx, gy)
    )
    assert fast == pytest.approx(plain, abs=AGREES * max(float(np.ptp(plain)), 1e-3))


@pytest.mark.parametrize("shape", [(240, 320), (480, 640), (243, 251), (720, 1280)])
def test_heights_agree_on_a_press(shape: tuple[int, int]) -> None:
    gy, gx = (g.astype(np.float32) for g in np.gradient(press(shape, 4.0), MM_PER_PX))
    fast, plain = both_ways(
        lambda compiled: PoissonSolver(shape, mm_per_px=MM_PER_PX, compiled=compiled).solve(gx, gy)
    )
    assert fast == pytest.approx(plain, abs=AGREES * float(np.ptp(plain)))
