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
from tactile_core.quantities import Reference
from tactile_sim import VirtualStage

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


DARKENS = """\
schema: 1
name: darkens
image: {width_px: 320, height_px: 240, mm_per_px: 0.08}
illumination: {use: core.constant, lights: [{name: white, azimuth_deg: 0, elevation_deg: 70}]}
calibration: {use: core.automatic}
optics: {coat: {absorption_per_mm: 0.5, scatters: volume}}
"""


def test_a_gel_that_darkens_with_depth_bulges_brighter_beside_a_single_ball(
    tmp_path: Path,
) -> None:
    (tmp_path / "darkens.yaml").write_text(DARKENS)
    stage = VirtualStage(str(tmp_path / "darkens.yaml"))
    undeformed = stage.frame()
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    examiner = Examiner(TouchBench.for_sensor(stage.profile, reference, 4.0))
    for number, (x_mm, y_mm) in enumerate([(0, 0), (-5, 3), (4, -3), (-4, -4), (5, 4), (1, 2)]):
        stage.reset()
        stage.indenter("sphere", x_mm=x_mm, y_mm=y_mm, diameter_mm=4.0)
        stage.press(depth_mm=0.6)
        assert examiner.examine(f"{number}", stage.frame()).why == ""
    stage.reset()
    two = np.zeros((120, 120))
    y, x = (axis * 0.1 for axis in np.indices(two.shape))
    for centre_mm in (3.0, 8.5):
        cap = 4.0 - (x - centre_mm) ** 2 - (y - 6.0) ** 2
        two = np.maximum(two, np.sqrt(np.maximum(cap, 0)))
    stage.indenter("heightmap", x_mm=0, y_mm=0, height_mm=two, mm_per_px=0.1)
    stage.press(depth_mm=0.6)
    assert examiner.examine("two", stage.frame()).why != ""
