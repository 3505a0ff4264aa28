"""Averaging down, whatever the number of channels."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.shrinking import shrunk


@given(
    channels=st.integers(1, 9),
    rows=st.integers(8, 40),
    columns=st.integers(8, 40),
    dtype=st.sampled_from([np.uint8, np.uint16, np.float32]),
)
def test_each_channel_keeps_its_mean(channels, rows, columns, dtype):
    image = np.random.default_rng(0).integers(0, 255, (40, 40, channels)).astype(dtype)
    small = shrunk(image, (columns, rows))
    assert small.shape == (rows, columns, channels)
    assert small.dtype == dtype
    np.testing.assert_allclose(small.mean(axis=(0, 1)), image.mean(axis=(0, 1)), atol=6)


@pytest.mark.parametrize("channels", [1, 3, 4, 6])
def test_halving_averages_four_pixels(channels):
    image = np.random.default_rng(1).random((10, 12, channels)).astype(np.float32)
    quarters = image.reshape(5, 2, 6, 2, channels).mean(axis=(1, 3))
    np.testing.assert_allclose(shrunk(image, (6, 5)), quarters, atol=1e-6)
