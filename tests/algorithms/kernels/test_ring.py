"""The contact within a steep ring agrees with OpenCV's contours and morphology."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import needs_kernels, seeds

from tactile_core.algorithms.slip.touched import contact_within_ring

pytestmark = needs_kernels


def agree(steep: np.ndarray, limit: float) -> np.ndarray:
    """The mask, if it is the same both ways."""
    fast, plain = (
        contact_within_ring(steep, limit, 0.0, compiled=compiled) for compiled in (True, False)
    )
    np.testing.assert_array_equal(fast, plain)
    return fast


@pytest.mark.parametrize("shape", [(60, 80), (45, 60), (120, 159), (9, 130), (2, 2)])
@given(seed=seeds, rings=st.integers(0, 4), noise=st.sampled_from([0.0, 0.3, 1.0]))
@settings(max_examples=25)
def test_masks_are_the_same(shape: tuple[int, int], seed: int, rings: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    steep = noise * np.abs(cv2.GaussianBlur(rng.normal(0, 2, shape), (0, 0), 1.5))
    y, x = np.mgrid[: shape[0], : shape[1]]
    for _ in range(rings):  # some leave the view, overlap or are tiny
        centre, radius = rng.uniform(0, shape), rng.uniform(0, 25)
        stretched = rng.uniform(0.5, 1.5)
        far = np.hypot((y - centre[0]) * stretched, x - centre[1])
        steep += np.exp(-np.square((far - radius) / rng.uniform(0.5, 3)))
    agree(steep.astype(np.float32), 0.6)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (2, 4), (3, 4), (3, 5), (7, 7)])
@pytest.mark.parametrize("corner", [(0, 0), (20, 20), (53, 71)])
def test_a_speck_is_left_out_alike(size: tuple[int, int], corner: tuple[int, int]) -> None:
    steep = np.zeros((60, 80), np.float32)
    steep[corner[0] : corner[0] + size[0], corner[1] : corner[1] + size[1]] = 1
    agree(steep, 0.5)


@given(seed=seeds)
@settings(max_examples=25)
def test_lines_and_thin_rings_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    image = np.zeros((60, 80), np.uint8)
    for _ in range(6):
        ends = rng.integers(0, (80, 60), (3, 2))
        cv2.polylines(image, [ends.reshape(-1, 1, 2)], bool(rng.integers(2)), 1)
    assert agree(image.astype(np.float32), 0.5).shape == image.shape
