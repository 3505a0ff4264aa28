"""Ridge regression whose penalty is chosen by sequences that it has not seen."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.force.clock_offset import fitted_ridge


@given(st.integers(0, 10_000), st.integers(1, 6))
@settings(max_examples=25, deadline=None)
def test_a_linear_world_is_recovered(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(60, count)) * 10.0 ** rng.uniform(-3, 3, count)
    weights = rng.normal(size=count)
    found = fitted_ridge(features, features @ weights, np.arange(60) // 12)
    force = features @ weights
    assert features @ found.weights == pytest.approx(force, abs=1e-6 * np.abs(force).max())
    assert found.held_out == pytest.approx(force, abs=1e-5 * np.abs(force).max())


def test_the_force_at_rest_is_zero() -> None:
    rng = np.random.default_rng(0)
    features = rng.normal(2.0, 1.0, (40, 3))
    found = fitted_ridge(features, rng.normal(5.0, 1.0, 40), np.arange(40) // 10)
    assert np.zeros(3) @ found.weights == 0


def test_a_held_out_prediction_never_sees_the_force_of_its_sequence() -> None:
    rng = np.random.default_rng(1)
    features, force = rng.normal(size=(40, 3)), rng.normal(size=40)
    sequences = np.arange(40) // 10
    changed = force.copy()
    changed[sequences == 2] += 1e-9 * rng.normal(size=10)
    before, after = (fitted_ridge(features, one, sequences) for one in (force, changed))
    assert before.penalty == after.penalty
    kept = sequences == 2
    np.testing.assert_array_equal(before.held_out[kept], after.held_out[kept])


def test_noise_is_penalised_more_than_a_clean_signal() -> None:
    rng = np.random.default_rng(2)
    features = rng.normal(size=(30, 12))
    clean = features[:, 0]
    noisy = 0.3 * clean + 3 * rng.normal(size=30)
    sequences = np.arange(30) // 6
    assert (
        fitted_ridge(features, clean, sequences).penalty
        < fitted_ridge(features, noisy, sequences).penalty
    )


@given(st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_a_rising_fit_never_falls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    load = np.sort(rng.uniform(0, 3, 30))
    features = np.stack([load**0.5, load, load**2], 1)
    found = fitted_ridge(features, np.sin(load) * 5, np.arange(30) // 6, rising=True)
    assert (np.diff(features @ found.weights) >= 0).all()


def test_one_sequence_is_fitted_almost_without_a_penalty() -> None:
    features = np.random.default_rng(3).normal(size=(20, 2))
    found = fitted_ridge(features, features @ [1.0, 2.0], np.zeros(20, np.intp))
    assert found.weights == pytest.approx([1, 2], rel=1e-6)


def test_a_feature_that_is_always_zero_does_no_harm() -> None:
    features = np.random.default_rng(4).normal(size=(20, 2))
    features[:, 1] = 0
    found = fitted_ridge(features, 3 * features[:, 0], np.arange(20) // 5)
    assert found.weights == pytest.approx([3, 0], rel=1e-6)
