"""Scores of force networks, and the standard deviations that their errors give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_train.scores import (
    covered_share,
    fitted_std,
    force_score,
    force_scores,
)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3))
def test_a_perfect_network_scores_1_and_a_constant_one_0(seed: int, scale: float) -> None:
    true = scale * np.random.default_rng(seed).normal(size=(20, 4))
    assert force_score("", true, true).r2 == pytest.approx([1, 1, 1, 1])
    mean = np.broadcast_to(true.mean(0), true.shape)
    assert force_score("", mean, true).r2 == pytest.approx([0, 0, 0, 0], abs=1e-9)


def test_contacts_beyond_the_view_are_scored_apart() -> None:
    true = np.random.default_rng(0).normal(size=(6, 4))
    outside = np.array([0, 0, 0, 0.05, 0.05, 0.5])
    scores = {
        one.of: one
        for one in force_scores(true + (outside > 0.1)[:, None], true, ["a", "b"] * 3, outside)
    }
    assert scores["at most a tenth of the force outside the view"].samples == 5
    assert scores["contact inside the view"].samples == 3
    assert scores["of these a"].samples == 3
    cut = scores["all, also contacts cut further by the border"]
    assert cut.samples == 6
    assert (cut.rmse > 0).all()


def test_standard_deviations_are_those_of_the_errors() -> None:
    rng = np.random.default_rng(0)
    true = np.zeros((20_000, 4))
    true[:, 2] = rng.uniform(0, 20, len(true))
    floor = np.array([0.1, 0.1, 0.2, 1.0])
    spread = np.hypot(floor, 0.05 * true[:, 2:3])
    found = true + spread * rng.normal(size=true.shape)
    std = fitted_std(found, true)
    assert covered_share(found, true, std) == pytest.approx([0.683] * 4, abs=0.03)
    for least in (0, 5, 10, 15):
        these = (true[:, 2] > least) & (true[:, 2] < least + 5)
        assert covered_share(found[these], true[these], std) == pytest.approx([0.683] * 4, abs=0.08)
