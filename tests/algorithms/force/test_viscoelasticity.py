"""Stress relaxation follows the Prony series for any division of time into steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.force.viscoelasticity import Branch, TimeStep

BRANCHES = (Branch(0.25, 1.0), Branch(0.15, 40.0))


def _strained(durations: list[float], positions: list[float]) -> tuple[float, float]:
    """Stress over modulus after a piecewise linear motion, and residual displacement."""
    u = np.zeros((3, 1, 1))
    stretches = np.zeros((2, 3, 1, 1))
    load = left = 0.0
    for seconds, position in zip(durations, positions, strict=True):
        time = TimeStep(BRANCHES, seconds)
        left = float(time.residual_displacement(u, stretches)[0, 0, 0])
        new = np.full_like(u, position)
        stretches = time.advance_stretches(stretches, new - u)
        load = time.stiffening * (position - left)
        u = new
    return load, left


@given(seconds=st.floats(0.01, 500.0))
def test_held_stress_follows_the_series(seconds: float) -> None:
    load, _ = _strained([0.0, seconds], [1.0, 1.0])
    series = 1 + sum(b.modulus_share * np.exp(-seconds / b.time_s) for b in BRANCHES)
    assert load == pytest.approx(series, rel=1e-9)


@given(cuts=st.lists(st.floats(0.01, 20.0), min_size=1, max_size=6))
def test_a_linear_motion_may_be_split_into_any_steps(cuts: list[float]) -> None:
    ends = np.cumsum(cuts) / sum(cuts)
    at_once, _ = _strained([sum(cuts)], [1.0])
    in_steps, _ = _strained(cuts, [float(end) for end in ends])
    assert in_steps == pytest.approx(at_once, rel=1e-9)


def test_the_relaxed_layer_is_elastic() -> None:
    assert _strained([0.0, 1e5], [1.0, 1.0])[0] == pytest.approx(1.0)
    assert _strained([0.0, np.inf], [1.0, 1.0]) == (1.0, 0.0)


def test_an_unloaded_gel_recovers_slowly() -> None:
    u, stretches = np.zeros((3, 1, 1)), np.zeros((2, 3, 1, 1))
    held = TimeStep(BRANCHES, 100.0)
    stretches, u = held.advance_stretches(stretches, np.ones_like(u)), np.ones_like(u)
    places = []
    for seconds in (0.0, 0.1, 1.0, 10.0, 1e4):
        step = TimeStep(BRANCHES, seconds)
        left = step.residual_displacement(u, stretches)
        stretches, u = step.advance_stretches(stretches, left - u), left
        places.append(float(u[0, 0, 0]))
    assert places == sorted(places, reverse=True)
    assert 0.05 < places[0] < 0.5
    assert abs(places[-1]) < 1e-3
