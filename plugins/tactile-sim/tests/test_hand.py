"""A hand that moves an object on a virtual sensor."""

from __future__ import annotations

import time

import numpy as np
import pytest
from support.virtual_lab import VirtualLab

from tactile_core.errors import InputError
from tactile_core.interfaces.simulator import Aim, HandCamera
from tactile_core.pipeline.opening import open_sensor
from tactile_core.profiles.loader import load_profile
from tactile_sim.camera import CalmHand
from tactile_sim.gel_surface import GelSurface


@pytest.fixture
def surface(lab: VirtualLab) -> GelSurface:
    return GelSurface(lab.profile, "fast")


def test_it_lowers_the_object_at_its_own_speed_and_lets_it_go(surface: GelSurface) -> None:
    hand = CalmHand(surface)
    hand.step(0.1)
    assert not surface.pressed
    hand.aim(Aim(1.0, -0.5, 0.0, 0.3, pressed=True))
    depths = []
    for _ in range(5):
        hand.step(0.1)
        depths.append(surface.depth_mm)
    steps = np.diff([0.0, *depths])
    assert (steps <= 1.5 * 0.1 + 1e-6).all()
    assert depths[-1] == pytest.approx(0.3)
    hand.aim(Aim(pressed=False))
    hand.step(0.1)
    assert not surface.pressed


def test_it_drags_and_twists_what_it_presses(surface: GelSurface) -> None:
    hand = CalmHand(surface)
    for goal in (Aim(0, 0, 0, 0.2, True), Aim(0.8, 0, 10, 0.2, True)):
        hand.aim(goal)
        for _ in range(5):
            hand.step(0.1)
    pose = surface._state.pose
    assert (pose.x_mm, pose.y_mm) == (pytest.approx(0.8), 0)
    assert pose.angle_deg == pytest.approx(10)


def test_it_never_presses_deeper_than_the_gel_bears(surface: GelSurface) -> None:
    hand = CalmHand(surface)
    hand.aim(Aim(0, 0, 0, 99.0, True))
    for _ in range(40):
        hand.step(0.1)
    assert surface.depth_mm == pytest.approx(hand.deepest_mm)
    assert hand.problem == ""


def test_beyond_the_gel_it_lets_go_and_says_why(surface: GelSurface) -> None:
    hand = CalmHand(surface)
    hand.aim(Aim(1e3, 0, 0, 0.2, True))
    hand.step(0.1)
    assert "outside the gel" in hand.problem
    assert not surface.pressed
    hand.aim(Aim(0, 0, 0, 0.2, True))
    hand.step(0.1)
    assert surface.pressed


def test_another_object_is_taken_after_the_first_is_released(surface: GelSurface) -> None:
    hand = CalmHand(surface)
    hand.aim(Aim(0, 0, 0, 0.2, True))
    hand.step(0.1)
    hand.take("cone", {"diameter_mm": 3.0})
    hand.step(0.1)
    assert not surface.pressed
    hand.step(0.1)
    assert surface.pressed
    with pytest.raises(InputError, match="there is no indenter"):
        hand.take("spoon", {})


def test_its_camera_shows_real_time_and_the_truth(lab: VirtualLab) -> None:
    overrides = {"camera": {"use": "sim.hand"}}
    profile = load_profile(lab.profile_path, sim=True, overrides=overrides)
    with open_sensor(profile, bundle=lab.bundle) as sensor:
        assert isinstance(sensor.camera, HandCamera)
        before = time.monotonic()
        sensor.camera.hand.aim(Aim(0, 0, 0, 0.2, True))
        frames = [sensor.acquire() for _ in range(3)]
        times = [frame.timestamp_s for frame in frames if frame is not None]
        assert before <= times[0] < times[1] < times[2] <= time.monotonic()
        assert sensor.camera.truth is not None
        assert sensor.camera.truth.depth_mm > 0
    with pytest.raises(InputError, match="closed"):
        _ = sensor.camera.hand


def test_a_surface_moves_its_object_in_one_step(surface: GelSurface) -> None:
    with pytest.raises(InputError, match="nothing is pressed"):
        surface.move(0.1)
    CalmHand(surface).aim(Aim())
    from tactile_sim.indenters import make_indenter

    surface.indent_with(make_indenter("sphere", diameter_mm=5))
    surface.press(depth_mm=0.2)
    surface.move(0.1, 0.2, 5.0, depth_mm=0.3, seconds=0.1)
    assert surface.depth_mm == pytest.approx(0.3)
    assert surface.time_s == pytest.approx(0.1)
    for depth_mm in (-1.0, float("nan"), 1e6):
        with pytest.raises(InputError):
            surface.move(depth_mm=depth_mm)
    assert surface.depth_mm == pytest.approx(0.3)
