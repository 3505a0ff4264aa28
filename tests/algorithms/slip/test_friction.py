"""The coefficient of friction, from the forces of a contact that sticks and slips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.slip.state import FrictionRecord, friction_ratio, slip_margin

newtons = st.floats(0.1, 20)


@given(newtons, newtons, newtons, st.floats(0.5, 2))
def test_a_wrong_modulus_scales_all_forces_and_leaves_their_ratio(
    fx: float, fy: float, fz: float, factor: float
) -> None:
    assert friction_ratio(fx * factor, fy * factor, fz * factor) == pytest.approx(
        friction_ratio(fx, fy, fz)
    )


def test_a_slipping_contact_shows_its_coefficient_ever_better() -> None:
    rng, record, stds = np.random.default_rng(0), FrictionRecord(assumed=0.9), []
    for ratio in rng.normal(0.4, 0.04, 50):
        record = record.slipping(float(ratio), 0.04)
        stds.append(record.std)
    assert record.coefficient == pytest.approx(0.4, abs=3 * 0.04 / 50**0.5)
    assert stds == sorted(stds, reverse=True)
    assert stds[-1] == pytest.approx(0.04 / 50**0.5)


def test_a_contact_that_sticks_shows_that_its_coefficient_is_no_smaller() -> None:
    record = FrictionRecord(assumed=0.3).sticking(0.5, 0.02).sticking(0.1, 0.02)
    assert record.coefficient == pytest.approx(0.48)
    assert record.std is None
    assert FrictionRecord().sticking(0.5, 0.02).coefficient is None


@given(st.floats(0, 3), st.floats(0.05, 2))
def test_the_margin_is_the_used_share_of_the_greatest_shear(
    ratio: float, coefficient: float
) -> None:
    margin = slip_margin(ratio, coefficient)
    assert 0 <= margin <= 1
    assert margin == pytest.approx(min(1, ratio / coefficient))


def test_without_normal_force_nothing_holds() -> None:
    assert friction_ratio(0.1, 0.0, 0.0) == np.inf
    assert slip_margin(0.1, 0.0) == 1
