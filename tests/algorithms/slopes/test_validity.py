"""A slope has two components, so it takes two readable channels."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.slopes.sampling import two_within

FLOOR, CEILING = 3.06, 251.94


def by_definition(pixels: np.ndarray) -> np.ndarray:
    within = (pixels > FLOOR) & (pixels < CEILING)
    return np.asarray(within.sum(axis=2) >= min(2, pixels.shape[2]))


@given(
    seed=st.integers(0, 2**32 - 1),
    channels=st.integers(1, 6),
    dtype=st.sampled_from([np.uint8, np.uint16, np.float32]),
    planar=st.booleans(),
)
def test_two_channels_within_the_bounds_make_a_pixel_valid(
    seed: int, channels: int, dtype: type, planar: bool
) -> None:
    levels = np.array([0, 3, 4, 100, 251, 252, 255], dtype)
    pixels = np.random.default_rng(seed).choice(levels, (13, 17, channels))
    if planar:
        pixels = np.ascontiguousarray(pixels.transpose(2, 0, 1)).transpose(1, 2, 0)
    valid = two_within(pixels, FLOOR, CEILING)
    assert valid.max() <= 1
    np.testing.assert_array_equal(valid.view(bool), by_definition(pixels))
