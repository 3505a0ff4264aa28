"""The analytic derivative of the fit's objective matches finite differences."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import check_grad

from tactile_core.algorithms.arrays import regression
from tactile_desktop_six_led.light_fit import _Objective


@given(lights=st.integers(3, 7), seed=st.integers(0, 10_000))
def test_the_jacobian_is_the_derivative_of_the_error(lights, seed):
    rng = np.random.default_rng(seed)
    logs = rng.normal(0, 0.3, (12, lights))
    terms = regression.terms(rng.uniform(-1, 1, (12, 2)), 2)
    target = rng.uniform(-0.6, 0.6, (12, 2)).astype(np.float32)
    start = np.concatenate([np.ones(lights), rng.normal(0, 0.2, 15 * lights + 12)])
    pressed = (np.arange(12) % 3 > 0).astype(np.float64)
    fit = _Objective(logs, terms, target, pressed, start, np.full(16 * lights + 12, 0.03))
    parameters = start + rng.normal(0, 0.1, start.shape)

    def cost(parameters):
        return 0.5 * (fit.error(parameters) ** 2).sum()

    def slope(parameters):
        return fit.jacobian(parameters).T @ fit.error(parameters)

    assert check_grad(cost, slope, parameters) < 1e-5
