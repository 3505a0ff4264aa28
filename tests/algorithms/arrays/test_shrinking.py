"""Shrinking keeps the mean, whatever the number of channels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.shrinking import repeat_pixels, shrink_image
from tactile_core.algorithms.light.drift import channel_gains
from tactile_core.algorithms.slopes.sampling import Sampling

sides = st.integers(1, 8)
SIZES = st.tuples(st.integers(1, 30), st.integers(1, 24))


@given(st.integers(1, 9), SIZES)
def test_channels_are_shrunk_independently_and_keep_their_mean(
    channels: int, size_px: tuple[int, int]
) -> None:
    image = np.random.default_rng(channels).uniform(0, 255, (25, 31, channels)).astype(np.float32)
    small = shrink_image(image, size_px)
    assert small.shape == (size_px[1], size_px[0], channels)
    np.testing.assert_allclose(small.mean(axis=(0, 1)), image.mean(axis=(0, 1)), rtol=1e-3)
    np.testing.assert_allclose(small[..., -1], shrink_image(image[..., -1], size_px), rtol=1e-5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_markers_are_filled_under_six_lights(dtype: type) -> None:
    levels = np.array([60, 80, 100, 120, 140, 160])
    pixels = np.full((101, 133, 6), levels, dtype)
    markers = np.zeros((101, 133), np.bool_)
    markers[40:60, 50:70] = True
    pixels[markers] = 5
    filled = Sampling(1, (101, 133), 0.0, 41).smooth(pixels, markers)
    assert filled.dtype == dtype
    np.testing.assert_allclose(filled[50, 60], levels, atol=2)


def test_drift_of_six_lights_is_estimated_in_a_small_image() -> None:
    undeformed = np.random.default_rng(1).uniform(80, 140, (41, 53, 6)).astype(np.float32)
    gains = np.array([1.03, 0.97, 1.01, 1.0, 0.98, 1.02])
    np.testing.assert_allclose(channel_gains(undeformed * gains, undeformed, 255), gains, rtol=1e-3)


@given(sides, sides, st.integers(1, 16))
def test_each_pixel_is_the_mean_of_the_pixels_it_covers(
    width: int, height: int, times: int
) -> None:
    image = np.random.default_rng(times).uniform(-1, 1, (height * times, width * times, 2))
    squares = image.reshape(height, times, width, times, 2)
    small = shrink_image(image.astype(np.float32), (width, height))
    assert small == pytest.approx(squares.mean(axis=(1, 3)), abs=1e-6)


@given(rows=st.integers(1, 9), columns=st.integers(1, 9), times=st.integers(1, 5))
def test_a_mask_is_enlarged_pixel_by_pixel(rows: int, columns: int, times: int) -> None:
    mask = np.random.default_rng(rows).integers(0, 2, (rows, columns)).astype(np.uint8)
    large = repeat_pixels(mask, (rows * times, columns * times))
    np.testing.assert_array_equal(large, np.kron(mask, np.ones((times, times), np.uint8)))


def test_a_mask_is_enlarged_to_any_size() -> None:
    mask = np.array([[0, 1], [1, 0]], np.uint8)
    large = repeat_pixels(mask, (5, 7))
    assert large.shape == (5, 7)
    assert (large[0, 0], large[0, -1], large[-1, 0], large[-1, -1]) == (0, 1, 1, 0)
