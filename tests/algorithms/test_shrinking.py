import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.shrinking import shrunk

sides = st.integers(1, 8)


@given(sides, sides, st.integers(1, 16))
def test_each_pixel_is_the_mean_of_those_it_stands_for(width: int, height: int, times: int) -> None:
    image = np.random.default_rng(times).uniform(-1, 1, (height * times, width * times, 2))
    squares = image.reshape(height, times, width, times, 2)
    small = shrunk(image.astype(np.float32), (width, height))
    assert small == pytest.approx(squares.mean(axis=(1, 3)), abs=1e-6)


@pytest.mark.parametrize("channels", [1, 3, 6])
def test_sizes_that_do_not_divide_keep_the_mean(channels: int) -> None:
    image = np.random.default_rng(0).uniform(0, 1, (37, 53, channels)).astype(np.float32)
    assert shrunk(image, (7, 5)).mean() == pytest.approx(image.mean(), abs=0.02)
