import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactile_core.algorithms.light.photometric import (
    STEEPEST_SINE,
    planes_to_gradient,
    to_normal_xy,
)


def to_gradient(normal_xy: np.ndarray) -> np.ndarray:
    nx, ny = (np.array(normal_xy[..., k], np.float32, ndmin=2) for k in (0, 1))
    planes_to_gradient(nx, ny)
    return np.stack([nx, ny], -1).reshape(normal_xy.shape)


STEEPEST_SLOPE = STEEPEST_SINE / np.sqrt(1 - STEEPEST_SINE**2)

any_normal_xy = arrays(np.float32, (4, 5, 2), elements=st.floats(-50, 50, width=32))


@given(arrays(np.float32, (5, 2), elements=st.floats(-3, 3, width=32)))
def test_normals_and_slopes_are_inverse(gradient: np.ndarray) -> None:
    np.testing.assert_allclose(to_gradient(to_normal_xy(gradient)), gradient, rtol=1e-4, atol=1e-5)


@given(any_normal_xy)
def test_no_normal_gives_a_slope_beyond_the_steepest(normal_xy: np.ndarray) -> None:
    assert np.linalg.norm(to_gradient(normal_xy), axis=-1).max() <= STEEPEST_SLOPE * 1.001


@given(any_normal_xy)
def test_a_normal_keeps_its_direction(normal_xy: np.ndarray) -> None:
    slopes = to_gradient(normal_xy).astype(float)
    size = np.linalg.norm(slopes, axis=-1) * np.linalg.norm(normal_xy.astype(float), axis=-1)
    np.testing.assert_allclose((slopes * normal_xy).sum(-1), size, rtol=1e-4, atol=1e-9)
