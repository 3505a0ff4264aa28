from math import comb

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.regression import fit_polynomial, terms


@given(st.integers(1, 5), st.integers(1, 4))
def test_there_is_one_term_per_monomial(features: int, order: int) -> None:
    count = terms(np.ones((2, features), np.float32), order).shape[1]
    assert count == comb(features + order, order)


def test_a_quadratic_comes_back_exactly() -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(500, 3)).astype(np.float32)
    y = np.stack([1 + 2 * x[:, 0] - x[:, 1] * x[:, 2], x[:, 2] ** 2], 1).astype(np.float32)
    fit = fit_polynomial(x, y, order=2, ridge=1e-9)
    np.testing.assert_allclose(fit(x), y, atol=1e-3)


def test_a_strong_ridge_shrinks_towards_nothing() -> None:
    x = np.random.default_rng(0).normal(size=(200, 2)).astype(np.float32)
    weak, strong = (fit_polynomial(x, x, order=1, ridge=r) for r in (1e-6, 10.0))
    assert np.abs(strong(x)).mean() < 0.2 * np.abs(weak(x)).mean()
