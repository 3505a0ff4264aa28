import json
from pathlib import Path

import pytest
from support.command_line import refused, tactile

from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import MarkerDetections

TACTIP = load_profile("tactip")


def test_the_scale_is_that_of_the_published_camera() -> None:
    per_camera_pixel_mm = 48 / 552
    assert TACTIP.image.mm_per_px == pytest.approx(per_camera_pixel_mm * 450 / 256, rel=0.01)


def test_what_is_not_published_is_left_out() -> None:
    assert TACTIP.gel.thickness_mm is None
    assert TACTIP.gel.shear_modulus_mpa is None
    assert TACTIP.camera.use == "core.replay"


def test_the_virtual_tactip_shows_its_pins() -> None:
    done = tactile("run", "tactip", "--sim", "--reference", "first", "--frames", 30, "--json")
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["sequence"] for line in lines] == list(range(30))
    assert {line["markers"]["seen"] for line in lines} == {127}
    assert "surface" not in lines[0]
    assert "no surface model in a bundle" in done.stderr
    assert "fit one with 'tactile calibrate-surface'" in done.stderr


@pytest.mark.parametrize("how", [["--live", "--ball-diameter-mm", "5"], ["--presses", "presses"]])
def test_a_ball_calibrates_no_pins(how: list[str], tmp_path: Path) -> None:
    message = refused("calibrate", "tactip", *how, "--out", tmp_path / "bundle")
    assert "this sensor has pins and no photometry" in message
    assert "tactile calibrate-surface" in message


def test_the_live_page_shows_the_virtual_dome() -> None:
    live = pytest.importorskip("tactile_live.opening")
    with live.open_live(live.WantedSensor("tactip"), sim=True) as sensor:
        assert len(sensor.read()[MarkerDetections].centres_px) == 127
