"""The kernels of the motion of a contact agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import AGREES, both_ways, needs_kernels, seeds

from tactile_core.algorithms.slip.contact_motion import contact_motion
from tactile_core.algorithms.slip.plane import positions_mm
from tactile_core.algorithms.slip.stick_region import stick_region

pytestmark = needs_kernels


@pytest.mark.parametrize("at_mm", [0.0, 6.0], ids=["inside", "at the border"])
@given(seed=seeds, every=st.integers(1, 3))
@settings(max_examples=6)
def test_the_motion_of_a_contact_agrees(at_mm: float, seed: int, every: int) -> None:
    spacing_mm, noise = 0.22, np.random.default_rng(seed).normal(0, 0.02, (2, 60, 80, 2))
    place = positions_mm((60, 80), spacing_mm)
    mask = np.abs(place - at_mm * (1 + 1j)) < 3.0
    before, now = (
        (0.05 * k + cv2.GaussianBlur(each, (0, 0), 2).view(np.complex128)[..., 0] + 0.02j * place)
        for k, each in enumerate(noise)
    )
    fields = now.astype(np.complex64), before.astype(np.complex64)
    fast, plain = both_ways(
        lambda compiled: contact_motion(*fields, spacing_mm, mask, every, compiled=compiled)
    )
    for name in ("displacement", "weight", "entropy_bits"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=0, atol=AGREES)
    position = place[mask][::every]
    fast, plain = both_ways(
        lambda compiled: stick_region(plain.displacement, position, plain.weight, compiled=compiled)
    )
    for name in ("shift_mm", "rotation_rad", "motion_mm", "rotation_mm", "sheared_mm"):
        assert getattr(fast, name) == pytest.approx(getattr(plain, name), abs=AGREES)
    for name in ("lag_mm", "weight"):
        np.testing.assert_allclose(getattr(fast, name), getattr(plain, name), rtol=0, atol=AGREES)
