"""A contact is lost only after it was held, and only if it was strong enough to be noticed."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.slip.contact_loss import (
    CONTACT_LOSS,
    ContactLossTracker,
    LossOfStrength,
    contact_strength,
)


def _followed(
    strength: Callable[[float], float], until_s: float, rate_hz: float = 25.0
) -> list[LossOfStrength]:
    tracker = ContactLossTracker()
    return [
        tracker.update(strength(number / rate_hz), number / rate_hz)
        for number in range(round(until_s * rate_hz) + 1)
    ]


def _ever_slips(losses: Iterable[LossOfStrength]) -> bool:
    return any(loss.slips for loss in losses)


def test_strength_is_zero_without_contact_and_one_at_the_weakest_contact() -> None:
    strain, relief = CONTACT_LOSS.strain, CONTACT_LOSS.relief
    assert contact_strength(0.3 * strain, 0.5 * relief) == 0
    assert contact_strength(strain, relief) == pytest.approx(1)
    assert contact_strength(None, np.sqrt(2) * relief) == pytest.approx(1)


@given(st.floats(0, 0.2), st.floats(0, 0.2), st.floats(0, 0.1))
def test_strength_grows_with_strain_and_with_relief(
    strain: float, relief: float, more: float
) -> None:
    strength = contact_strength(strain, relief)
    assert contact_strength(strain + more, relief) >= strength
    assert contact_strength(strain, relief + more) >= strength
    assert contact_strength(strain, relief) >= contact_strength(None, relief)


def test_levels_without_contact_are_those_of_the_sensor_at_hand() -> None:
    assert contact_strength(0.07, 0.01, free_strain=0.0667, free_relief=0.01) < 2
    assert contact_strength(0.07, 0.01) > 30


@settings(max_examples=30, deadline=None)
@given(st.floats(0, 100), st.floats(0, 50))
def test_nothing_is_lost_of_a_contact_that_stays_or_grows(strength: float, growth: float) -> None:
    losses = _followed(lambda time_s: strength + growth * time_s, 4.0)
    assert not _ever_slips(losses)
    least = CONTACT_LOSS.uncertainty
    assert all(loss.lost <= least / (least + loss.settled) + 1e-9 for loss in losses)


@pytest.mark.parametrize("rate_hz", [6.25, 12.5, 25.0, 60.0])
@pytest.mark.parametrize("left", [0.0, 0.2, 0.4])
def test_an_object_that_slides_out_is_lost_at_any_frame_rate(rate_hz: float, left: float) -> None:
    losses = _followed(lambda time_s: 20.0 if time_s < 2 else 20.0 * left, 2.5, rate_hz)
    whole = 20 + CONTACT_LOSS.uncertainty
    assert max(loss.lost for loss in losses) == pytest.approx(1 - left * 20 / whole)
    first = next(number for number, loss in enumerate(losses) if loss.slips)
    assert first == np.ceil(2 * rate_hz)


def test_the_weaker_a_contact_is_the_more_of_it_may_be_lost() -> None:
    least = CONTACT_LOSS.uncertainty
    last = [_followed(lambda _, held=held: held * least, 2.0)[-1] for held in (0, 1, 4, 99)]
    assert [loss.lost for loss in last] == pytest.approx([1.0, 0.5, 0.2, 0.01])


@pytest.mark.parametrize(("left", "slips"), [(0.45, True), (0.6, False)])
def test_half_of_the_strength_is_the_limit(left: float, slips: bool) -> None:
    losses = _followed(lambda time_s: 20.0 if time_s < 2 else 20.0 * left, 2.5)
    assert _ever_slips(losses) is slips


def test_a_touch_that_never_settled_is_not_expected_to_last() -> None:
    brief_s = 0.8 * CONTACT_LOSS.settle_s
    losses = _followed(lambda time_s: 50.0 if 1 < time_s < 1 + brief_s else 0.0, 3.0)
    assert not any(loss.known for loss in losses)
    assert not _ever_slips(losses)


def test_frames_of_an_earlier_touch_at_the_start_of_a_recording_are_ignored() -> None:
    losses = _followed(lambda time_s: 50.0 if time_s < 0.3 else 0.0, 2.0)
    assert not _ever_slips(losses)


def test_a_gel_that_relaxes_slowly_does_not_slip() -> None:
    losses = _followed(lambda time_s: 5 + 15 * np.exp(-time_s / 6.0), 30.0)
    assert not _ever_slips(losses)


def test_a_lost_object_is_forgotten_so_that_a_weaker_grasp_is_not_reported() -> None:
    def strength(time_s: float) -> float:
        if time_s < 2:
            return 100.0
        return 0.0 if time_s < 2 + 5 * CONTACT_LOSS.memory_s else 3.0

    losses = _followed(strength, 16.0)
    again = [loss for number, loss in enumerate(losses) if number / 25 > 12.6]
    assert _ever_slips(losses)
    assert all(loss.known and loss.lost < 0.2 for loss in again)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0, 0.99), min_size=30, max_size=60))
def test_a_contact_too_weak_to_be_noticed_is_no_evidence(strengths: list[float]) -> None:
    tracker = ContactLossTracker()
    losses = [tracker.update(value, number / 25) for number, value in enumerate(strengths)]
    assert not any(loss.known or loss.slips for loss in losses)
    assert all(0 <= loss.lost <= 1 for loss in losses)


def test_a_reset_forgets_the_contact() -> None:
    tracker = ContactLossTracker()
    for number in range(50):
        tracker.update(30.0, number / 25)
    tracker.reset()
    assert tracker.update(0.0, 0.0) == LossOfStrength(0.0, 0.0, 0.0)
    assert not tracker.update(0.0, 1.0).slips
