"""Touches are found in live frames: new, still, and not slid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from tactile_core.acquisition.acquisition import average
from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.guided.background import UndeformedCells
from tactile_core.calibration.guided.touch import TOUCH, Still, Touches
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame
from tactile_sim.optics.rig import render

SHAPE, MM_PER_PX, BALL_MM = (120, 160), 0.125, 4.0
BALL_PX = BALL_MM / 2 / MM_PER_PX
PROFILE = Profile.model_validate(
    {
        "schema": 1,
        "name": "small",
        "description": "three lights",
        "image": {"width_px": 160, "height_px": 120, "mm_per_px": MM_PER_PX},
        "gel": {},
        "illumination": {
            "use": "core.constant",
            "lights": [
                {"name": name, "azimuth_deg": azimuth, "elevation_deg": 30}
                for name, azimuth in (("red", 90), ("green", 210), ("blue", 330))
            ],
        },
    }
)
HERE, THERE = (70.0, 60.0), (100.0, 50.0)
Place = tuple[tuple[float, float], float]
NOTHING: Place = (HERE, 0.0)


def frame(place: Place, number: int) -> Frame:
    """A frame of a ball at (x, y), this many mm deep."""
    (centre, depth) = place
    height = np.zeros(SHAPE)
    if depth:
        height = BallPress(centre, BALL_MM, depth).height_mm(SHAPE, MM_PER_PX)
    pixels = render(PROFILE, height, seed=number)
    return Frame(pixels, ("red", "green", "blue"), MM_PER_PX, timestamp_s=number / 15)


def stills(places: Sequence[Place], *, brightness: float = 1.0) -> list[Still]:
    """The presses that are found in frames of these places, after some without a touch."""
    cells = UndeformedCells(average([frame(NOTHING, n) for n in range(1000, 1003)]), BALL_PX)
    touches, found = Touches(BALL_PX), []
    for number, place in enumerate([NOTHING] * 4 + list(places)):
        taken = frame(place, number)
        if brightness != 1:
            taken = replace(taken, pixels=np.rint(taken.pixels * brightness).astype(np.uint8))
        still = touches.add(taken, cells.change(taken))
        if still is not None:
            found.append(still)
    return found


def held(centre: tuple[float, float], frames: int = 8) -> list[Place]:
    return [(centre, 0.2), (centre, 0.5), *[(centre, 0.7)] * frames]


def test_a_press_that_is_held_is_found_once() -> None:
    (still,) = stills([*held(HERE, 14), NOTHING])
    assert still.slid_balls < TOUCH.slide_balls
    # the frame is one of those that were held
    assert still.frame.sequence == 0
    assert 6 / 15 <= still.frame.timestamp_s <= 19 / 15


def test_a_second_press_needs_a_lift_in_between() -> None:
    half_lifted: list[Place] = [(HERE, 0.4), (HERE, 0.25)]
    assert len(stills([*held(HERE), *half_lifted, *held(HERE), NOTHING])) == 1
    assert len(stills([*held(HERE), NOTHING, *held(HERE), NOTHING])) == 2


def test_a_press_that_moves_is_never_still() -> None:
    moving = [((60.0 + 2 * n, 60.0), 0.7) for n in range(14)]
    assert stills([*moving, NOTHING]) == []


def test_a_press_that_is_too_short_is_not_still() -> None:
    assert stills([*held(HERE, 2), NOTHING]) == []


def test_a_ball_that_slid_before_it_was_still_has_slid() -> None:
    x, y = HERE
    slide = [((x + 4 * n, y), 0.7) for n in range(5)]
    (still,) = stills([*slide, *held((x + 20, y))[2:], NOTHING])
    assert still.slid_balls > TOUCH.slide_balls


@pytest.mark.parametrize("brightness", [0.93, 1.05])
def test_a_change_of_the_light_is_no_touch(brightness: float) -> None:
    assert stills([NOTHING] * 12, brightness=brightness) == []
    assert len(stills([*held(THERE), NOTHING], brightness=brightness)) == 1
