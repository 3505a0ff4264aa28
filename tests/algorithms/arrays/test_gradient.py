"""Gradients of planes are exact, whatever the spacing and the smoothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.gradient import gradient, steepness

INNER = np.s_[1:-1, 1:-1]


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.1, 10), st.booleans())
def test_the_gradient_of_a_plane_is_its_slope(
    x: float, y: float, spacing: float, smooth: bool
) -> None:
    rows, columns = np.indices((6, 8)) * spacing
    plane = (x * columns + y * rows).astype(np.float32)
    along, down = gradient(plane, spacing, smooth=smooth)
    assert along[INNER] == pytest.approx(x, abs=1e-4)
    assert down[INNER] == pytest.approx(y, abs=1e-4)
    assert steepness(plane, spacing, smooth=smooth)[INNER] == pytest.approx(
        np.hypot(x, y), abs=1e-4
    )


def test_a_single_channel_keeps_its_axis() -> None:
    image = np.random.default_rng(0).random((5, 6, 1), np.float32)
    for slope in gradient(image):
        assert slope.shape == image.shape
