"""The narrowest interval is found wherever it is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.regression import narrowest


@given(st.lists(st.integers(-50, 50), min_size=1, max_size=30), st.floats(0, 1))
def test_no_interval_with_as_many_values_is_narrower(values: list[int], share: float) -> None:
    ordered = np.sort(np.array(values, float))
    count = 1 + int(share * (len(ordered) - 1))
    first, length = narrowest(ordered, count)
    assert length == ordered[first + count - 1] - ordered[first]
    assert length == min(np.ptp(ordered[i : i + count]) for i in range(len(ordered) - count + 1))


def test_rows_are_independent() -> None:
    first, length = narrowest(np.array([[0, 1, 5, 9], [0, 4, 8, 9]]), 2)
    assert first.tolist() == [0, 2]
    assert length.tolist() == [1, 1]


def test_the_interval_of_all_values_is_their_range() -> None:
    assert narrowest(np.array([1.0, 2.0, 7.0]), 3) == pytest.approx((0, 6))
