"""Gradients of planes are exact, whatever the spacing and the smoothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.shrinking import gradient, steepness

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


@given(st.integers(1, 5), st.integers(1, 5), st.sampled_from([(), (1,), (2,)]))
def test_an_image_is_mirrored_at_its_border(
    rows: int, columns: int, channels: tuple[int, ...]
) -> None:
    image = np.random.default_rng(rows + 6 * columns).random((rows, columns, *channels), np.float32)
    wide = np.pad(image, [(1, 1), (1, 1), *[(0, 0)] * len(channels)], mode="reflect")
    if rows == 1:
        wide[0] = wide[2] = wide[1]
    if columns == 1:
        wide[:, 0] = wide[:, 2] = wide[:, 1]
    along, down = gradient(image, 0.5)
    np.testing.assert_allclose(along, wide[1:-1, 2:] - wide[1:-1, :-2], rtol=1e-6)
    np.testing.assert_allclose(down, wide[2:, 1:-1] - wide[:-2, 1:-1], rtol=1e-6)
