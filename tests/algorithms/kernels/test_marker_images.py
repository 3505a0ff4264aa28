"""The kernels of marker images agree with numpy, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from support.kernel_agreement import both_ways, needs_kernels

from tactile_core.algorithms.markers import contrast_of, mask_of

pytestmark = needs_kernels


@pytest.mark.parametrize("diameter_px", [7, 14, 20, 26])
@pytest.mark.parametrize("shape", [(48, 64, 3), (49, 66, 3), (48, 64), (48, 64, 4)])
def test_contrast_and_mask_are_the_same_bytes(shape: tuple[int, ...], diameter_px: float) -> None:
    noise = np.random.default_rng(0).uniform(-200, 455, shape)
    image = np.clip(cv2.GaussianBlur(noise, (0, 0), 1), 0, 255).astype(np.uint8)
    fast, plain = both_ways(
        lambda compiled: contrast_of(image, diameter_px=diameter_px, compiled=compiled)
    )
    np.testing.assert_array_equal(fast, plain)
    fast, plain = both_ways(lambda compiled: mask_of(plain, shape[:2], compiled=compiled))
    np.testing.assert_array_equal(fast, plain)
    assert 0 < plain.mean() < 1
