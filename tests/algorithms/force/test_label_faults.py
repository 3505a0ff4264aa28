"""Faults of a load cell that its readings show."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.force.cell_axes import (
    at_rest,
    is_clipped,
    rest_offset,
    runs_between_rests,
)

PRESS = np.concatenate([np.zeros(20), np.linspace(0, 5, 20), np.linspace(5, 0, 20)])


@given(st.integers(0, 1000), st.sampled_from([1.0, -1.0]))
@settings(max_examples=25, deadline=None)
def test_a_plateau_at_the_extreme_is_clipped(seed: int, sign: float) -> None:
    force = sign * PRESS + 0.01 * np.random.default_rng(seed).normal(size=60)
    assert not is_clipped(force)
    assert is_clipped(np.clip(force, -3, 3))


def test_equal_readings_at_rest_are_not_clipped() -> None:
    assert not is_clipped(np.maximum(PRESS - 1, 0))
    assert not is_clipped(np.zeros(30))


def test_a_cell_that_was_not_zeroed_has_an_offset_at_rest() -> None:
    still = at_rest(np.stack([PRESS, PRESS**2], 1))
    assert still[PRESS == 0].all()
    assert not still[PRESS > 0.5].any()
    assert rest_offset(PRESS, still) == 0
    assert rest_offset(PRESS + 1.5, still) == pytest.approx(1.5, abs=0.05)


def test_noise_at_rest_is_no_offset() -> None:
    noisy = PRESS + 0.05 * np.random.default_rng(0).normal(size=60)
    assert rest_offset(noisy, PRESS == 0) == 0


def test_each_press_between_rests_is_a_run() -> None:
    runs = runs_between_rests(np.tile(PRESS, 3))
    assert set(runs) == {0, 1, 2}
    for run in range(3):
        assert np.tile(PRESS, 3)[runs == run].max() == 5


def test_noise_at_rest_begins_no_run() -> None:
    noisy = np.tile(PRESS, 2) + 0.1 * np.random.default_rng(1).normal(size=120)
    assert set(runs_between_rests(np.abs(noisy))) == {0, 1}
