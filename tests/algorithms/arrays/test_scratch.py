from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.quantile import quantile, sigma_of
from tactile_core.algorithms.arrays.scratch import borrowed


def test_arrays_borrowed_at_the_same_time_differ() -> None:
    with borrowed((30, 40), np.float32) as first, borrowed((30, 40), np.float32) as second:
        assert not np.shares_memory(first, second)


def test_returned_memory_is_reused_for_any_dtype() -> None:
    with borrowed((30, 40), np.float32) as first:
        pass
    with borrowed((30, 40, 4), np.uint8) as second:
        assert np.shares_memory(first, second)
        assert second.shape == (30, 40, 4)


def test_each_thread_has_its_own_memory() -> None:
    together = Barrier(2)

    def lend(value: int) -> bool:
        with borrowed((100, 100), np.int64) as mine:
            mine[:] = value
            together.wait()
            return bool((mine == value).all())

    with ThreadPoolExecutor(2) as pool:
        assert all(pool.map(lend, [1, 2]))


def test_memory_is_returned_after_an_error() -> None:
    with pytest.raises(ZeroDivisionError), borrowed((7, 9), np.float64) as first:
        raise ZeroDivisionError
    with borrowed((7, 9), np.float64) as second:
        assert np.shares_memory(first, second)


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=40), st.floats(0, 1))
def test_quantiles_equal_those_of_numpy(values: list[float], share: float) -> None:
    some = np.array(values)
    assert quantile(some, share) == pytest.approx(np.quantile(some, share), abs=1e-9)


def test_sigma_is_robust_to_outliers() -> None:
    residuals = np.random.default_rng(0).normal(0, 3, 10_000)
    assert sigma_of(residuals) == pytest.approx(3, rel=0.03)
    assert sigma_of(np.append(residuals, np.full(1000, 1e6))) == pytest.approx(3, rel=0.2)
