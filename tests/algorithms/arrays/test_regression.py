from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.regression import (
    PolynomialFit,
    degrees,
    fit_polynomial,
    terms,
)
from tactile_core.errors import CalibrationError


@given(st.integers(1, 5), st.integers(1, 4))
def test_there_is_one_term_per_monomial(features: int, order: int) -> None:
    count = terms(np.ones((2, features), np.float32), order).shape[1]
    assert count == comb(features + order, order)


def test_a_quadratic_is_recovered_exactly() -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(500, 3)).astype(np.float32)
    y = np.stack([1 + 2 * x[:, 0] - x[:, 1] * x[:, 2], x[:, 2] ** 2], 1).astype(np.float32)
    fit = fit_polynomial(x, y, order=2, ridge=1e-9)
    np.testing.assert_allclose(fit(x), y, atol=1e-3)


def test_a_strong_ridge_shrinks_the_coefficients_to_zero() -> None:
    x = np.random.default_rng(0).normal(size=(200, 2)).astype(np.float32)
    weak, strong = (fit_polynomial(x, x, order=1, ridge=r) for r in (1e-6, 10.0))
    assert np.abs(strong(x)).mean() < 0.2 * np.abs(weak(x)).mean()


def test_a_penalty_of_curvature_keeps_planes() -> None:
    x = np.random.default_rng(0).normal(size=(500, 2)).astype(np.float32)
    plane = 2 + 3 * x[:, :1] - x[:, 1:]
    curved = fit_polynomial(x, plane, order=3, ridge=1.0, curvature_only=True)
    np.testing.assert_allclose(curved(x), plane, atol=0.02)
    shrunk = fit_polynomial(x, plane, order=3, ridge=1.0)
    assert np.abs(shrunk(x) - plane).mean() > 0.3


def test_a_penalty_of_curvature_grows_with_the_degree() -> None:
    x = np.linspace(-2, 2, 400, dtype=np.float32)[:, None]
    z = (x - x.mean()) / x.std()
    square, cube = z**2 - 1, z**3 - (z**4).mean() * z
    kept = []
    for term in (square, cube):
        fit = fit_polynomial(x, term, order=3, ridge=0.3, curvature_only=True)
        kept.append(float((fit(x) * term).sum() / (term * term).sum()))
    assert 1 > kept[0] > 2 * kept[1] > 0


def test_each_term_has_the_degree_of_its_product() -> None:
    x = np.full((1, 3), 2.0)
    np.testing.assert_array_equal(terms(x, 4)[0], 2.0 ** degrees(3, 4))


def test_a_penalty_of_variation_keeps_the_mean_response_and_drops_its_change_with_the_place() -> (
    None
):
    rng = np.random.default_rng(0)
    features = rng.uniform(-1, 1, (4000, 4)).astype(np.float32)
    response = (1 + 0.5 * features[:, 2:3]) * features[:, :1] + 0.3 * features[:, 3:]
    steps = np.array([[1, 0, 0, 0], [1, 0, 1, 0], [0, 0, 0, 1]], np.float32)
    free, uniform = (
        fit_polynomial(features, response, ridge=1e-6, curvature_only=True, variation=variation)
        for variation in (0.0, 100.0)
    )
    np.testing.assert_allclose(free(steps)[:, 0], [1, 1.5, 0.3], atol=0.01)
    np.testing.assert_allclose(uniform(steps)[:, 0], [1, 1, 0.3], atol=0.05)


def test_samples_that_determine_no_coefficients_are_refused() -> None:
    level = np.zeros((20, 3), np.float32)
    with pytest.raises(CalibrationError, match="check that the images"):
        fit_polynomial(level, level[:, :2], ridge=0.0)


@pytest.mark.parametrize("order", [-1, 1, 3, 1e300])
def test_coefficients_of_another_order_are_refused(order: float) -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(50, 3)).astype(np.float32)
    arrays = fit_polynomial(x, x[:, :2], order=2).arrays()
    assert PolynomialFit.from_arrays(arrays).order == 2
    with pytest.raises(ValueError, match="order"):
        PolynomialFit.from_arrays(arrays | {"order": np.array(order)})


@pytest.mark.parametrize("name", ["mean", "std", "coefficients"])
def test_arrays_of_another_shape_are_refused(name: str) -> None:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(50, 3)).astype(np.float32)
    arrays = fit_polynomial(x, x[:, :2], order=2).arrays()
    with pytest.raises(ValueError, match=r"mean and std|coefficients"):
        PolynomialFit.from_arrays(arrays | {name: arrays[name][..., None]})
