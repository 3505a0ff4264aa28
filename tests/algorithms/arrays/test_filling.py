"""Unknown pixels are interpolated from the known ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.filling import fill_unknown, filled_together

Array = NDArray[Any]


@settings(deadline=None)
@given(
    st.tuples(st.integers(1, 40), st.integers(1, 40)),
    st.floats(0, 1),
    st.integers(0, 2**32 - 1),
    st.sampled_from([np.float32, np.float64]),
)
def test_known_pixels_are_kept_and_the_others_are_between_them(
    shape: tuple[int, int], share: float, seed: int, dtype: type
) -> None:
    rng = np.random.default_rng(seed)
    image: Array = rng.standard_normal(shape).astype(dtype)
    known = rng.random(shape) < share
    known.flat[rng.integers(known.size)] = True
    spoilt: Array = np.where(known, image, 1e6).astype(dtype)
    result = fill_unknown(spoilt, known)
    assert result.dtype == dtype
    assert np.array_equal(result[known], image[known])
    assert result.min() >= image[known].min() - 1e-5
    assert result.max() <= image[known].max() + 1e-5


def test_holes_in_a_slope_are_bridged() -> None:
    y, x = np.mgrid[:90, :130].astype(np.float32)
    ramp = 0.02 * x - 0.01 * y
    known = np.hypot(x % 30 - 15, y % 30 - 15) > 5
    assert fill_unknown(np.where(known, ramp, 9), known) == pytest.approx(ramp, abs=0.05)


def test_images_filled_together_equal_images_filled_one_by_one() -> None:
    rng = np.random.default_rng(0)
    images = list(rng.standard_normal((2, 33, 47)))
    known = rng.random((33, 47)) > 0.6
    for one, both in zip(images, filled_together(images, known), strict=True):
        assert np.array_equal(fill_unknown(one, known), both)
