"""The kernels of spots agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import AGREES, both_ways, needs_kernels, seeds, several, shapes

from tactile_core.algorithms.markers.spots import measured_spots

pytestmark = needs_kernels


@given(shape=shapes, seed=seeds, share=st.floats(0, 1))
@several
def test_spots_agree(shape: tuple[int, int], seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    dark = (rng.random(shape) < share).astype(np.uint8)
    weight = rng.integers(0, 256, shape).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: measured_spots(dark, weight, weight, faintest=20, rim=1, compiled=compiled)
    )
    for name in ("mass", "centres", "sigma_px", "peak", "truncated"):
        a, b = getattr(fast, name), getattr(plain, name)
        assert a == pytest.approx(b, rel=AGREES, abs=AGREES)


@given(shape=shapes, seed=seeds, reach=st.integers(1, 3))
@several
def test_spots_are_numbered_alike(shape: tuple[int, int], seed: int, reach: int) -> None:
    rng = np.random.default_rng(seed)
    dark = (cv2.GaussianBlur(rng.random(shape), (0, 0), 1.5) > 0.5).astype(np.uint8)
    weight = rng.integers(1, 256, shape).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: measured_spots(
            dark, weight, weight, faintest=0, rim=reach, compiled=compiled
        )
    )
    np.testing.assert_array_equal(fast.mass, plain.mass)
    np.testing.assert_array_equal(fast.truncated, plain.truncated)
