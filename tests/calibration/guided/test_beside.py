"""Whether something touches beside a ball, whatever light a single ball throws around itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core import open_sensor
from tactile_core.calibration.guided.examination import (
    BESIDE,
    Examiner,
    TouchBench,
    with_something_beside,
)
from tactile_core.profiles.loader import load_profile

REPOSITORY = Path(__file__).resolve().parents[3]
GEL = np.array([0.3, 0.1])


def test_a_brightening_that_every_ball_has_is_no_second_contact() -> None:
    presses = {f"{n}": GEL * scale for n, scale in enumerate(np.linspace(0.7, 1.5, 12))}
    assert with_something_beside(presses) == set()


@pytest.mark.parametrize("place", [0, 1])
def test_one_that_stands_out_is_found_at_either_distance(place: int) -> None:
    presses = {f"{n}": GEL.copy() for n in range(BESIDE.fewest_presses)}
    presses["3"][place] *= 1.1 * BESIDE.typical
    assert with_something_beside(presses) == {"3"}


def test_the_first_presses_are_only_compared_with_their_own_ball() -> None:
    assert with_something_beside({"0": GEL}) == set()
    assert with_something_beside({"0": GEL, "1": np.array([1.0, 1.0])}) == {"1"}


def test_no_ball_on_a_real_sensor_is_taken_for_two(recordings: Path) -> None:
    folder = recordings / "gelsight_mini" / "ball_presses"
    profile = load_profile(REPOSITORY / "experiments" / "profiles" / "gelsight_mini.yaml")
    with open_sensor(profile, input=folder / "background.png", reference="first") as sensor:
        sensor.read()
        reference = sensor.pipeline.reference
    assert reference is not None
    examiner = Examiner(TouchBench.for_sensor(profile, reference, 6.31))
    reasons = set()
    for press in sorted(folder.glob("press_*.png"))[:9]:
        with open_sensor(profile, input=press, reference=reference) as sensor:
            frame = sensor.acquire()
        assert frame is not None
        verdict = examiner.examine(press.stem, frame)
        reasons |= {verdict.why, *verdict.withdrawn.values()}
    assert len(examiner.kept) >= BESIDE.fewest_presses
    assert reasons <= {"", "the image border cuts the contact; press further inside"}
