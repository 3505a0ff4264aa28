"""Slopes are those of a plane, whatever the spacing and the smoothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.gradient import gradient, steepness

INNER = np.s_[1:-1, 1:-1]


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.1, 10), st.booleans())
def test_a_plane_has_its_slopes(x: float, y: float, spacing: float, smooth: bool) -> None:
    rows, columns = np.indices((6, 8)) * spacing
    plane = (x * columns + y * rows).astype(np.float32)
    along, down = gradient(plane, spacing, smooth=smooth)
    assert along[INNER] == pytest.approx(x, abs=1e-4)
    assert down[INNER] == pytest.approx(y, abs=1e-4)
    assert steepness(plane, spacing, smooth=smooth)[INNER] == pytest.approx(
        np.hypot(x, y), abs=1e-4
    )


def test_a_channel_is_a_channel_even_if_it_is_the_only_one() -> None:
    image = np.random.default_rng(0).random((5, 6, 1), np.float32)
    for slope in gradient(image):
        assert slope.shape == image.shape
