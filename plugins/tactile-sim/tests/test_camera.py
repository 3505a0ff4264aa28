"""The virtual camera behind the camera interface."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from tactile_core import load_profile, open_sensor
from tactile_core.acquisition.devices import make_devices
from tactile_core.errors import InputError
from tactile_sim import VirtualStage

SCRIPT = """\
steps:
  - indenter: {kind: sphere, diameter_mm: 3}
  - press: {depth_mm: 0.3, frames: 2}
"""


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    (tmp_path / "script.yaml").write_text(SCRIPT)
    path = tmp_path / "virtual.yaml"
    path.write_text(
        "extends: desktop_six_led\nname: virtual\n"
        "illumination: {dark: true}\n"
        "image: {width_px: 306, height_px: 256, mm_per_px: 0.0272, rotate_deg: 90}\n"
        "sim: {camera: {use: sim.virtual, script: script.yaml, seed: 3}}\n"
    )
    return path


def test_it_is_read_like_any_sensor(profile: Path) -> None:
    with open_sensor(profile, sim=True, reference="first") as sensor:
        frames = [reading.frame for reading in sensor.stream()]
    assert [frame.pixels.shape for frame in frames] == [(256, 306, 6)] * 3
    assert not np.array_equal(frames[0].pixels, frames[-1].pixels)


def test_its_frames_are_those_of_the_stage_minus_the_dark_exposure(profile: Path) -> None:
    virtual_profile = load_profile(profile, sim=True)
    stage = VirtualStage(virtual_profile, seed=3)
    with open_sensor(virtual_profile, reference="first") as sensor:
        seen = sensor.read().frame.pixels
    dark, *_ = [image for image in stage.exposures() if np.median(image) < 10]
    stage.reset()
    shown = stage.frame().pixels
    np.testing.assert_allclose(seen.astype(int), np.maximum(shown.astype(int) - dark, 0), atol=1)


def test_a_users_script_is_played(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(SCRIPT)
    script = tmp_path / "mine.yaml"
    with open_sensor("hex_fingertip", sim=True, script=script, reference="first") as sensor:
        assert len(list(sensor.stream())) == 3
    with pytest.raises(InputError, match="--sim"):
        open_sensor("hex_fingertip", script=script)


def test_it_ends_with_its_script_or_restarts(profile: Path) -> None:
    virtual_profile = load_profile(profile, sim=True)
    camera, lights, _ = make_devices(virtual_profile)
    exposures = len(lights.exposures())
    with camera:
        images = list(iter(camera.read, None))
    assert len(images) == 3 * exposures
    again = load_profile(profile, sim=True, overrides={"camera": {"loop": True}})
    camera, *_ = make_devices(again)
    with camera:
        first = list(islice(iter(camera.read, None), 4 * exposures))
    np.testing.assert_array_equal(first[0].pixels, first[3 * exposures].pixels)
    assert [image.sequence for image in first] == list(range(4 * exposures))


@pytest.mark.parametrize("pause_s", [0.0, 0.05])
def test_timestamps_are_simulated_and_independent_of_the_machine(
    tmp_path: Path, pause_s: float
) -> None:
    script = tmp_path / "timed.yaml"
    script.write_text(SCRIPT + "  - shear: {dx_mm: 0.2, frames: 2, seconds: 1.0}\n")
    times = []
    with open_sensor("hex_fingertip", sim=True, script=script, reference="first") as sensor:
        for reading in sensor.stream():
            times.append((reading.frame.timestamp_s, reading.frame.wall_time_s))
            sleep(pause_s)
    stamps, walls = zip(*times, strict=True)
    assert stamps == pytest.approx([0, 1 / 30, 2 / 30, 2 / 30 + 0.5, 2 / 30 + 1.0])
    assert set(walls) == {0.0}


def test_time_continues_when_the_script_restarts(profile: Path) -> None:
    camera, lights, _ = make_devices(
        load_profile(profile, sim=True, overrides={"camera": {"loop": True}})
    )
    with camera:
        seen = [image.timestamp_s for image in islice(iter(camera.read, None), 8 * 7)]
    assert len(lights.exposures()) == 7
    assert sorted(set(seen)) == pytest.approx([shot / 30 for shot in range(8)])
    assert seen == sorted(seen)
