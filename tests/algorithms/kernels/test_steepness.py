"""The kernel of steepness agrees with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from support.kernel_agreement import AGREES, both_ways, needs_kernels

from tactile_core.algorithms.slip.touched import steepness_of

pytestmark = needs_kernels


@pytest.mark.parametrize(("shape", "step_px"), [((120, 160), 4), ((240, 320), 2), ((121, 161), 4)])
def test_the_steepness_on_the_grid_of_slip_agrees(shape: tuple[int, int], step_px: int) -> None:
    noise = np.random.default_rng(0).normal(0, 1, shape).astype(np.float32)
    cells = cv2.GaussianBlur(noise, (0, 0), 2)
    fast, plain = both_ways(
        lambda compiled: steepness_of(
            cells, step_px, (480, 640), 8, spacing_mm=0.22, compiled=compiled
        )
    )
    np.testing.assert_allclose(fast[0], plain[0], rtol=0, atol=AGREES)
    assert fast[1] == pytest.approx(plain[1], abs=AGREES)
