"""``tactile evaluate floor`` on a recording with measured forces, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.command_line import refused, tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.formats.images import write_png
from tactile_core.sim.analytic_ball import BallPress
from tactile_core.sim.stage import VirtualStage

SIZE = {"image": {"width_px": 160, "height_px": 120, "mm_per_px": 0.1104}}
PROFILE = """schema: 1
name: small
extends: hex_fingertip_unmarked
image: {width_px: 160, height_px: 120, mm_per_px: 0.1104}
camera: {width_px: 160, height_px: 120}
estimators:
  height: null
  contact: null
  load: {use: core.load}
"""


@pytest.fixture
def profile(tmp_path: Path) -> str:
    path = tmp_path / "small.yaml"
    path.write_text(PROFILE)
    return str(path)


def evaluated(*words: object) -> list[dict[str, object]]:
    done = tactile("evaluate", "floor", *words, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["figure"] == "floor"
    return list(found["floors"])


def test_a_recording_is_judged_by_its_forces(profile: str, tmp_path: Path) -> None:
    stage = VirtualStage("hex_fingertip_unmarked", overrides=SIZE)
    stage.indenter("sphere", diameter_mm=8)
    lines, folder = ["file,fz_n"], tmp_path / "recording"
    folder.mkdir()
    for number in range(12):
        if number > 5:
            stage.press(force_n=0.4 * (number - 5))
        write_png(folder / f"{number:02d}.png", stage.frame().pixels)
        lines.append(f"{number:02d}.png,{stage.truth().wrench[2]:.4f}")
    forces = tmp_path / "forces.csv"
    forces.write_text("\n".join(lines))
    words = profile, "--input", folder, "--reference", "first", "--forces", forces
    (floor,) = evaluated(*words)
    assert floor["rest_frames"] == 5  # the reference is not among them
    assert floor["least_n"] == pytest.approx(0.4, rel=0.01)
    table = tactile("evaluate", "floor", *words).stdout.splitlines()
    assert table[1].split()[:3] == ["load", "recording", "0.400"]
    forces.write_text("\n".join([*lines, "missing.png,1.0"]))
    assert "names 13 frames" in refused("evaluate", "floor", *words)


def test_the_sensor_or_the_recording_must_be_named(profile: str) -> None:
    assert "either --sim, or --input" in refused("evaluate", "floor", profile)


def test_the_normals_of_a_ball_are_compared_with_its_own(lab: VirtualLab, tmp_path: Path) -> None:
    for number, place in enumerate(((60.0, 50.0), (95.0, 70.0))):
        lab.save(tmp_path / "ball" / f"{number}.png", BallPress(place, BALL_MM, 0.6))
    words = "evaluate", "normals", lab.profile_path, "--bundle", lab.bundle
    ball = "--input", tmp_path / "ball", "--ball-diameter-mm", BALL_MM
    done = tactile(*words, *ball, "--out", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    *presses, whole = json.loads(done.stdout)["presses"]
    assert [press["name"] for press in presses] == ["0.png", "1.png"]
    assert whole["pixels"] == sum(press["pixels"] for press in presses)
    assert whole["mean_deg"] < 5
    assert whole["pitch_slope"] == pytest.approx(1, abs=0.15)
    assert "yaw in degrees" in (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "needs --input, --bundle and --ball-diameter-mm" in refused(*words)


def test_a_profile_without_force_is_refused_with_the_steps_that_give_one() -> None:
    words = "evaluate", "floor", "desktop_three_colour", "--sim"
    assert "add core.load or core.force_elastic" in refused(*words)
