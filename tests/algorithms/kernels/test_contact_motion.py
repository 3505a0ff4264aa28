"""The compiled motion of a contact agrees with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import AGREES, needs_kernels, seeds

from tactile_core.algorithms.arrays.types import Complex64
from tactile_core.algorithms.slip.contact_motion import contact_motion, recent_motion
from tactile_core.algorithms.slip.plane import coarse_field, positions_mm
from tactile_core.algorithms.slip.recent_fields import RecentFields, SpanLimits
from tactile_core.algorithms.slip.stick_region import StickRegion

SHAPE, SPACING_MM = (60, 80), 0.22
PLACE = positions_mm(SHAPE, SPACING_MM)

pytestmark = needs_kernels
several = settings(max_examples=6)


def field(rng: np.random.Generator, mm: float) -> Complex64:
    """Displacement that grows with the distance from the centre, with smooth noise."""
    noise = cv2.GaussianBlur(rng.normal(0, 0.02, (*SHAPE, 2)), (0, 0), 2).view(np.complex128)
    return np.asarray(mm * (1 + 0.3j * PLACE) + noise[..., 0], np.complex64)


@pytest.mark.parametrize("at_mm", [0.0, 6.0, 8.0], ids=["inside", "at the border", "outside"])
@given(seed=seeds, every=st.integers(1, 3))
@several
def test_the_motion_and_the_stick_region_agree(at_mm: float, seed: int, every: int) -> None:
    rng = np.random.default_rng(seed)
    before, now = field(rng, 0.0), field(rng, 0.05)
    mask = np.abs(PLACE - at_mm * (1 + 1j)) < 4.0
    fast, plain = (
        contact_motion(now, before, SPACING_MM, mask, every, noise_mm=0.004, compiled=compiled)
        for compiled in (True, False)
    )
    np.testing.assert_array_equal(fast.points, plain.points)
    for name in ("displacement", "weight", "entropy_bits"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=0, atol=AGREES)
    for name in StickRegion._fields:
        one, other = getattr(fast.region, name), getattr(plain.region, name)
        np.testing.assert_allclose(one, other, rtol=0, atol=AGREES)
    fast_recent, plain_recent = (
        recent_motion(now, before, SPACING_MM, plain.points, plain.weight, compiled=compiled)
        for compiled in (True, False)
    )
    for one, other in zip(fast_recent, plain_recent, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=AGREES)


@given(seed=seeds, frames=st.integers(1, 9), enough_mm=st.floats(0.0, 0.2))
@several
def test_the_frames_of_a_motion_agree(seed: int, frames: int, enough_mm: float) -> None:
    rng, found = np.random.default_rng(seed), []
    moved_mm = np.cumsum(rng.normal(0.02, 0.02, frames))
    fields = [field(rng, mm) for mm in moved_mm]
    points = np.flatnonzero(np.abs(PLACE) < 3)
    for compiled in (True, False):
        recent = RecentFields(5, compiled=compiled)
        for each in fields:
            recent.append(each)
        assert len(recent) == min(frames, 5)
        np.testing.assert_array_equal(recent[1], fields[-1])
        np.testing.assert_array_equal(recent[len(recent)], fields[-len(recent)])
        limits = SpanLimits(0.95, enough_mm, 0.003)
        found.append(recent.span(field(np.random.default_rng(1), 0.2), points, limits))
    (fast_span, fast_mm), (plain_span, plain_mm) = found
    assert fast_span == plain_span
    assert fast_mm == pytest.approx(plain_mm, abs=AGREES)


@pytest.mark.parametrize("cells", [(48, 64), (30, 40), (3, 4), (240, 320)])
def test_the_field_on_the_grid_of_slip_agrees(cells: tuple[int, int]) -> None:
    values = np.random.default_rng(0).normal(0, 1, (*cells, 2)).astype(np.float32)
    fast, plain = (coarse_field(values, (240, 320), 4, compiled=c) for c in (True, False))
    np.testing.assert_allclose(fast, plain, rtol=0, atol=10 * AGREES)
