"""A few equations in plain numbers have the solution of numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.symmetric import solved


@given(st.integers(1, 5), st.integers(0, 2**16), st.floats(0, 2))
def test_the_solution_satisfies_the_equations(count: int, seed: int, ridge: float) -> None:
    rng = np.random.default_rng(seed)
    samples = rng.normal(size=(4 * count, count))
    matrix, right = samples.T @ samples, rng.normal(size=count)
    x = solved(matrix, right, ridge)
    assert (matrix + ridge * np.eye(count)) @ x == pytest.approx(right, abs=1e-9)


def test_nothing_given_is_changed() -> None:
    matrix, right = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([3.0, 3.0])
    assert solved(matrix, right) == pytest.approx([1, 1])
    assert matrix.tolist() == [[2, 1], [1, 2]]
    assert right.tolist() == [3, 3]
