"""The kernels of the kinds of markers agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import both_ways, needs_kernels, seeds, several

from tactile_core.algorithms.markers.kinds import kinds_of
from tactile_core.algorithms.markers.spots import Spots

pytestmark = needs_kernels


@given(seed=seeds, count=st.integers(1, 60))
@several
def test_kinds_of_spots_agree(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    minor = rng.uniform(1, 3, count)
    mass = 255 * rng.lognormal(3, 1, count)
    spots = Spots(
        mass,
        rng.uniform(0, 99, (count, 2)),
        rng.uniform(-1.5, 1.5, count),
        np.stack([minor * rng.uniform(1, 3, count), minor], axis=1),
        rng.integers(40, 200, count).astype(np.uint8),
        rng.random((count, 4)) < 0.05,
    )
    fast, plain = both_ways(lambda compiled: kinds_of(spots, compiled=compiled))
    for name in ("marker", "piece", "bar", "truncated"):
        np.testing.assert_array_equal(getattr(fast, name), getattr(plain, name))
    assert fast.half_size == pytest.approx(plain.half_size)
    if fast.half_size > 0:
        np.testing.assert_allclose(fast.mass, plain.mass)
