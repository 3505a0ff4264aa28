"""The kernels of contact agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import both_ways, needs_kernels, seeds

from tactile_core.algorithms.contact import contact_mask

pytestmark = needs_kernels


@pytest.mark.parametrize(("shape", "step_px"), [((120, 160), 1), ((240, 320), 2), ((96, 88), 3)])
@given(seed=seeds, noise_mm=st.sampled_from([0.0, 0.01]))
@settings(max_examples=6)
def test_contacts_agree(shape: tuple[int, int], step_px: int, seed: int, noise_mm: float) -> None:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]]
    height = noise_mm * cv2.GaussianBlur(rng.normal(0, 3, shape), (0, 0), 2)
    for _ in range(3):  # they may overlap each other, or leave the view
        centre, radius = rng.uniform(0, shape), rng.uniform(5, 30)
        cap = 1 - (np.square(y - centre[0]) + np.square(x - centre[1])) / radius**2
        height = np.maximum(height, rng.uniform(0.1, 0.5) * cap)

    def mask(compiled: bool) -> np.ndarray:
        return contact_mask(
            height.astype(np.float32), mm_per_px=0.05 / step_px, step_px=step_px, compiled=compiled
        )

    fast, plain = both_ways(mask)
    np.testing.assert_array_equal(fast, plain)
