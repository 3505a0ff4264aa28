"""The estimated reference keeps the illumination and loses the relief."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.light.photometric import smooth_background

SHAPE = 60, 80
COEFFICIENT = st.floats(-0.3, 0.3)


def light(a: float, b: float, c: float) -> NDArray[np.float64]:
    """Return the illumination of a light that fades across the gel."""
    x = np.linspace(-1, 1, SHAPE[1])
    y = np.linspace(-1, 1, SHAPE[0])[:, None]
    return 100 * np.exp(a * x + b * y - 0.4 * x**2 + c * x**2 * y**2 + 0 * y)


@given(COEFFICIENT, COEFFICIENT, COEFFICIENT)
@settings(max_examples=30)
def test_a_flat_gel_is_its_own_background(a: float, b: float, c: float) -> None:
    undeformed = np.stack([light(a, b, c), light(b, c, a)], axis=2)
    np.testing.assert_allclose(smooth_background(undeformed), undeformed, rtol=1e-4)


@given(COEFFICIENT, st.integers(6, 60), st.floats(0.3, 2.0))
@settings(max_examples=30)
def test_a_groove_leaves_no_trace(a: float, column: int, gain: float) -> None:
    undeformed = light(a, -a, 0.1)[..., None]
    pressed = undeformed.copy()
    pressed[:, column : column + 10] *= gain
    np.testing.assert_allclose(smooth_background(pressed), undeformed, rtol=0.025)


def test_markers_do_not_count() -> None:
    undeformed = light(0.1, 0.2, 0.1)[..., None]
    marker_mask = np.zeros(SHAPE, bool)
    marker_mask[::3] = True
    marked = np.where(marker_mask[..., None], 1.0, undeformed)
    np.testing.assert_allclose(smooth_background(marked, marker_mask), undeformed, rtol=1e-4)


def test_black_pixels_and_bytes_are_accepted() -> None:
    image = np.rint(light(0.1, 0.1, 0.0)).astype(np.uint8)[..., None]
    image[10:14, 20:30] = 0
    background = smooth_background(image)
    assert background.dtype == np.float32
    assert background.shape == (*SHAPE, 1)
    assert np.isfinite(background).all()
    assert background.min() > 0
