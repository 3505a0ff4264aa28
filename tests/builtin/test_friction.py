"""``core.friction``: the coefficient while a contact slips, and the margin while it sticks."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.builtin.imprint_motion import FrictionEstimator
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.interfaces.sink import Reading
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Friction, Quantity, SlipState, Wrench

STD = {"fx_std_n": 0.02, "fy_std_n": 0.02, "fz_std_n": 0.1, "tz_std_nmm": 0.1}


def made(friction: float | None) -> FrictionEstimator:
    profile = load_profile("hex_fingertip")
    gel = profile.gel.model_copy(update={"friction": friction})
    return FrictionEstimator(Options(), SensorContext(profile.image, gel))


def wrench(shear_n: float, normal_n: float = 2.0) -> Wrench:
    return Wrench(0.6 * shear_n, -0.8 * shear_n, normal_n, 0.0, **STD, timestamp_s=1.5)


STICK, SLIP, NONE = (
    SlipState("stick", 0.1),
    SlipState("slip", 1.0, "translation"),
    SlipState("none", 0.0),
)


def test_before_slip_the_profile_s_coefficient_gives_the_margin() -> None:
    found = made(0.5).estimate(STICK, wrench(0.4))
    assert found.coefficient == 0.5
    assert found.coefficient_std is None
    assert found.margin == pytest.approx(0.4)
    assert found.timestamp_s == 1.5


def test_slip_measures_the_coefficient_which_holds_until_the_contact_ends() -> None:
    step = made(0.9)
    for _ in range(4):
        slipping = step.estimate(SLIP, wrench(0.6))
    assert slipping.coefficient == pytest.approx(0.3)
    assert slipping.margin == pytest.approx(1)
    assert slipping.coefficient_std is not None
    assert step.estimate(STICK, wrench(0.3)).margin == pytest.approx(0.5)
    assert step.estimate(NONE, Wrench(0, 0, 0, 0)).margin is None
    assert step.estimate(STICK, wrench(0.3)).coefficient == 0.9


def test_nothing_is_assumed_where_the_profile_gives_no_coefficient() -> None:
    step = made(None)
    assert step.estimate(STICK, wrench(0.4)).margin is None
    step.estimate(SLIP, wrench(0.8))
    assert step.estimate(STICK, wrench(0.4)).margin == pytest.approx(0.5)


def test_a_normal_force_within_its_noise_says_nothing() -> None:
    assert made(0.5).estimate(SLIP, wrench(0.4, normal_n=0.2)).coefficient is None


def test_a_turning_contact_does_not_show_the_coefficient() -> None:
    found = made(0.5).estimate(SlipState("slip", 1.0, "rotation"), wrench(0.1))
    assert found.coefficient == 0.5


def test_the_line_of_a_reading_holds_friction_and_margin_in_the_entry_slip() -> None:
    frame = Frame(np.zeros((4, 6, 3), np.uint8), ("r", "g", "b"), 0.1)
    quantities: dict[type[Quantity], Quantity] = {
        SlipState: STICK,
        Friction: Friction(0.5, None, 0.25),
    }
    slip = Reading(frame, quantities, {}).summary()["slip"]
    assert (slip["state"], slip["friction"], slip["margin"]) == ("stick", 0.5, 0.25)
