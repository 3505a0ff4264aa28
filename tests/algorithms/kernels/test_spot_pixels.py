"""The kernel of the pixels of dark spots agrees with OpenCV, which is the definition."""

from __future__ import annotations

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.kernel_agreement import both_ways, needs_kernels, seeds, several, shapes

from tactile_core.algorithms.markers.spot_pixels import spot_pixels

pytestmark = needs_kernels

DARKEST = 20.0


def assert_same(contrast: np.ndarray, size_px: float) -> None:
    fast, plain = both_ways(
        lambda compiled: spot_pixels(contrast, size_px, darkest=DARKEST, compiled=compiled)
    )
    np.testing.assert_array_equal(fast.dark != 0, plain.dark != 0)
    np.testing.assert_array_equal(fast.weight, plain.weight)
    np.testing.assert_array_equal(fast.peaks, plain.peaks)
    assert fast.level == plain.level


@given(shape=shapes, size_px=st.floats(0.5, 20), grain_px=st.floats(0.1, 3), seed=seeds)
@several
def test_spot_pixels_are_the_same_bytes(
    shape: tuple[int, int], size_px: float, grain_px: float, seed: int
) -> None:
    noise = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)
    assert_same(np.asarray(cv2.GaussianBlur(noise, (0, 0), grain_px)).reshape(shape), size_px)


def test_thresholds_are_rounded_alike() -> None:
    # markers of a pixel are neither smoothed nor opened; each contrast has its peak on the left
    peak, contrast = np.tril_indices(256)
    pairs = np.stack([peak, contrast, np.zeros_like(peak), np.zeros_like(peak)], axis=1)
    image = np.zeros((3 * 257, 512), np.uint8)
    image[::3] = pairs.reshape(257, 512)
    assert_same(image, 1.0)
