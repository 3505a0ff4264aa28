"""``tactile calibrate --live`` leads, records, fits, and can be finished from the recording."""

from __future__ import annotations

import json
from pathlib import Path
from unittest.mock import patch

import pytest
from support.command_line import refused, tactile

from tactile_core.bundles.manifest import read_manifest
from tactile_core.calibration.guided.session import SESSION
from tactile_core.errors import CameraLost
from tactile_core.pipeline.sensor import Sensor
from tactile_core.quantities import Frame

PROFILE = """\
extends: desktop_three_colour
name: small
image: {width_px: 160, height_px: 120, mm_per_px: 0.09}
calibration: {use: core.polynomial}
"""
BALL = "{kind: sphere, diameter_mm: 3.2"
PLACES = ((0.0, 0.0), (-4.2, -2.8), (4.2, 2.8))


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder with a small rig, and with the script of a person who presses three times."""
    (tmp_path / "small.yaml").write_text(PROFILE)
    nothing = [f"{{indenter: {BALL}}}}}", "{press: {depth_mm: 0, frames: 14}}", "{release: {}}"]
    steps = list(nothing)
    for x, y in PLACES:
        steps += [
            f"{{indenter: {BALL}, x_mm: {x}, y_mm: {y}}}}}",
            "{press: {depth_mm: 0.6, frames: 3}}",
            "{press: {depth_mm: 0.6, frames: 13}}",
            "{release: {}}",
            *nothing[:1],
            "{press: {depth_mm: 0, frames: 3}}",
            "{release: {}}",
        ]
    (tmp_path / "person.yaml").write_text("\n".join(["steps:", *(f"- {s}" for s in steps)]))
    return tmp_path


def live(small: Path, *words: object) -> tuple[object, ...]:
    script = ("--live", "--sim", "--script", small / "person.yaml")
    ball = ("--ball-diameter-mm", "3.2", "--out", small / "bundle")
    return ("calibrate", small / "small.yaml", *script, *ball, *words)


def test_a_session_is_led_recorded_and_fitted_again_from_its_recording(small: Path) -> None:
    pytest.importorskip("mcap")
    done = tactile(*live(small, "--json", "--measured-with", "ring gauge"))
    assert done.returncode == 0, done.stderr
    assert read_manifest(small / "bundle").measured_with == "ring gauge"
    assert "Keep your hands off the gel" in done.stderr
    *advice, result = map(json.loads, done.stdout.splitlines())
    assert advice[-1]["kept"] == len(result["presses"]) == len(PLACES)
    assert {"press", "hold", "lift"} <= {one["state"] for one in advice}
    assert (small / "bundle" / "report.html").is_file()

    again = tactile(
        *("calibrate", small / "small.yaml", "--presses", result["recording"]),
        *("--out", small / "again", "--json"),
    )
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["held_out"] == result["held_out"]


def test_when_enough_is_kept_the_next_touch_is_measured(small: Path) -> None:
    pytest.importorskip("mcap")
    with patch.object(SESSION, "most_presses", 2):
        done = tactile(*live(small, "--json"))
    assert done.returncode == 0, done.stderr
    assert "Lift the ball, then touch the gel with anything" in done.stderr
    *_, result, last = map(json.loads, done.stdout.splitlines())
    assert len(result["presses"]) == 2
    assert last["measured"]["max_height_mm"] == pytest.approx(0.6, rel=0.2)
    # the last of the three places, at the depth of its press
    assert last["measured"]["contact_area_mm2"] > 1


def test_a_lost_camera_keeps_the_presses_and_says_how_to_finish(small: Path) -> None:
    pytest.importorskip("mcap")
    acquire, frames = Sensor.acquire, iter(range(50))

    def lost(sensor: Sensor, timeout_s: float | None = None) -> Frame | None:
        if next(frames, None) is None:
            raise CameraLost("the camera was unplugged")
        return acquire(sensor, timeout_s)

    with patch.object(Sensor, "acquire", lost):
        done = tactile(*live(small))
    assert done.returncode != 0
    assert "the camera was unplugged" in done.stderr
    assert f"--presses {small / 'bundle.mcap'} --out {small / 'bundle'}" in done.stderr
    assert not (small / "bundle").exists()


def test_what_live_cannot_use_is_refused(small: Path) -> None:
    said = refused(*live(small, "--presses", small))
    assert "--live takes its presses from the camera" in said
    without = ("calibrate", small / "small.yaml", "--live", "--out", small / "bundle")
    assert "--live needs the ball" in refused(*without)
    assert "or --live to be led" in refused("calibrate", small / "small.yaml", "--out", small / "b")


def test_a_virtual_sensor_without_a_script_is_pressed_as_guidance_asks(small: Path) -> None:
    pytest.importorskip("mcap")
    done = tactile(
        *("calibrate", small / "small.yaml", "--live", "--sim", "--ball-diameter-mm", "3.2"),
        *("--out", small / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout.splitlines()[-1])["presses"]) >= 8
