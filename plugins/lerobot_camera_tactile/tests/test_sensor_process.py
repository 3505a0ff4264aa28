"""The sensor's process and the memory that it shares, without LeRobot."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from support import live_sensor
from support.mjpeg_server import MjpegServer
from support.virtual_lab import VirtualLab

from tactile_core import HeightMap, open_sensor

PLUGIN = Path(__file__).resolve().parents[1]
PROCESS = PLUGIN / "lerobot_camera_tactile" / "sensor_process.py"
SIZE = 12, 16


@pytest.fixture(scope="module")
def process() -> ModuleType:
    """The module, by its path as the sensor's interpreter runs it."""
    spec = importlib.util.spec_from_file_location("sensor_process", PROCESS)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def options(profile: str, **others: Any) -> dict[str, Any]:
    names = "serial", "bundle", "reference", "script"
    return {"profile": profile, "sim": True, **dict.fromkeys(names), **others}


def started(*words: Any) -> subprocess.Popen[str]:
    given = [word if isinstance(word, str) else json.dumps(word) for word in words]
    return subprocess.Popen(
        [sys.executable, "-P", PROCESS, *given],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def answer(*words: Any) -> Any:
    said, errors = started(*words).communicate()
    return json.loads(said) if said else errors


@pytest.fixture
def measuring(lab: VirtualLab, tmp_path: Path, process: ModuleType) -> Iterator[Any]:
    """A process that measures, and what it shares."""
    image = lab.profile.image
    path = tmp_path / "frames"
    shared = process.SharedFrames(path, image.height_px, image.width_px, create=True)
    running = started(
        "measure",
        options(str(lab.profile_path), bundle=str(lab.bundle)) | {"path": str(path), "fps": 30},
    )
    with running:
        yield running, shared
        running.kill()


def test_two_processes_share_arrays_without_loss(tmp_path: Path, process: ModuleType) -> None:
    rng = np.random.default_rng(1)
    written = process.SharedFrames(tmp_path / "frames", *SIZE, create=True)
    read = process.SharedFrames(tmp_path / "frames", *SIZE)
    for number in range(1, 10):
        rgb = rng.integers(0, 256, (*SIZE, 3), np.uint8)
        height_mm = rng.normal(size=SIZE).astype(np.float32)
        written.write(number, rgb, height_mm)
        pixels, heights = read.read(number)
        np.testing.assert_array_equal(pixels, rgb)
        np.testing.assert_array_equal(heights, height_mm)


def test_what_newer_observations_replaced_is_not_mixed_with_them(
    tmp_path: Path, process: ModuleType
) -> None:
    shared = process.SharedFrames(tmp_path / "frames", *SIZE, create=True)
    for number in range(1, 9):
        level = np.full((*SIZE, 3), number, np.uint8)
        shared.write(number, level, level[..., 0].astype(np.float32))
    assert shared.read(1) is None
    assert shared.read(9) is None
    pixels, heights = shared.read(8)
    assert set(np.unique(pixels)) == set(np.unique(heights)) == {8}


def test_an_image_is_rgb_as_it_is_or_the_grey_mean_of_its_lights(process: ModuleType) -> None:
    rng = np.random.default_rng(2)
    colours = rng.integers(0, 256, (*SIZE, 3), np.uint8)
    np.testing.assert_array_equal(process.rgb_of(colours, 255), colours)
    grey = process.rgb_of(colours[..., :1], 255)
    np.testing.assert_array_equal(grey, np.repeat(colours[..., :1], 3, axis=2))
    six = np.stack([np.full(SIZE, level, np.uint16) for level in (0, 0, 0, 100, 200, 300)], 2)
    assert set(np.unique(process.rgb_of(six, 1000))) == {round(100 * 255 / 1000)}
    assert process.rgb_of(six.astype(np.float32) + 1e4, 1000).max() == 255


def test_a_profile_is_described_without_its_devices(lab: VirtualLab) -> None:
    found = answer("describe", options(str(lab.profile_path), bundle=str(lab.bundle)))
    assert found == {
        "name": "virtual_lab",
        "height_px": 120,
        "width_px": 160,
        "fps": 30.0,
        "no_depth": "",
        "numbers": ["contact_area_mm2"],
    }
    assert answer("describe", options("hex_fingertip", sim=False))["fps"] == 30


def test_a_starting_calibration_counts_although_its_reference_comes_with_the_first_image() -> None:
    found = answer("describe", options("gelsight_mini", sim=False))
    assert found["no_depth"] == ""
    assert found["numbers"] == ["fx_n", "fy_n", "fz_n", "tz_nmm", "contact_area_mm2"]


def test_why_there_are_no_heights_is_said(lab: VirtualLab) -> None:
    uncalibrated = answer("describe", options(str(lab.profile_path)))
    assert "needs a bundle to measure height; give it" in uncalibrated["no_depth"]
    assert "no step that measures height" in answer("describe", options("tactip"))["no_depth"]


def test_an_unusable_profile_is_one_sentence() -> None:
    assert list(answer("describe", options("nobody"))) == ["error"]
    assert "there is no profile 'nobody'" in answer("describe", options("nobody"))["error"]


def test_observations_are_those_of_the_sensor(lab: VirtualLab, measuring: Any) -> None:
    running, shared = measuring
    assert "notes" in json.loads(running.stdout.readline())
    with open_sensor(lab.profile_path, bundle=lab.bundle, sim=True) as sensor:
        for number in range(1, 4):
            line, reading = json.loads(running.stdout.readline()), sensor.read()
            pixels, heights = shared.read(number)
            assert (line["number"], line["sequence"]) == (number, reading.frame.sequence)
            assert line["has_height"]
            np.testing.assert_array_equal(pixels, reading.frame.pixels)
            np.testing.assert_array_equal(heights, reading[HeightMap].mm)


def test_a_script_starts_again_at_its_end_with_the_same_frames(
    lab: VirtualLab, measuring: Any
) -> None:
    running, shared = measuring
    running.stdout.readline()
    first: dict[int, Any] = {}
    repeated = 0
    while repeated < 3:
        line = json.loads(running.stdout.readline())
        found = shared.read(line["number"])
        if line["sequence"] in first and found is not None:
            repeated += 1
            for one, same in zip(found, first[line["sequence"]], strict=True):
                np.testing.assert_array_equal(one, same)
        elif found is not None:
            first[line["sequence"]] = found


def test_it_ends_with_lerobot_s_process(measuring: Any) -> None:
    running, _ = measuring
    running.stdout.readline()
    running.stdin.close()
    assert running.wait(20) == 0


def test_control_c_is_left_to_lerobot(measuring: Any) -> None:
    running, _ = measuring
    running.stdout.readline()
    os.kill(running.pid, signal.SIGINT)
    numbers = [json.loads(running.stdout.readline())["number"] for _ in range(3)]
    assert numbers == [1, 2, 3]


def test_a_lerobot_before_the_interface_is_refused_in_one_sentence(tmp_path: Path) -> None:
    cameras = tmp_path / "lerobot" / "cameras"
    cameras.mkdir(parents=True)
    for folder in (cameras.parent, cameras):
        (folder / "__init__.py").touch()
    (cameras / "camera.py").write_text("class Camera: ...\n")
    about = tmp_path / "lerobot-0.4.3.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: lerobot\nVersion: 0.4.3\n")
    ended = subprocess.run(
        [sys.executable, "-c", "import lerobot_camera_tactile"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{PLUGIN}"},
    )
    assert ended.stderr.splitlines()[-1] == (
        "ImportError: tactile cameras need LeRobot 0.4.4 or newer, whose cameras have read_latest, "
        "but LeRobot 0.4.3 is installed; run: pip install 'lerobot>=0.4.4'"
    )


def test_a_live_sensor_gives_its_own_stamps_and_says_that_it_was_lost(
    tmp_path: Path, process: ModuleType
) -> None:
    path = tmp_path / "frames"
    shared = process.SharedFrames(path, 48, 64, create=True)
    with MjpegServer(live_sensor.send) as server:
        profile = live_sensor.profile(tmp_path, live_sensor.stream(server.url))
        given = options(str(profile), sim=False) | {"path": str(path), "fps": None}
        running = started("measure", given)
        assert running.stdout is not None
        running.stdout.readline()
        lines = [json.loads(running.stdout.readline()) for _ in range(5)]
        assert time.monotonic() > lines[-1]["taken_s"] > lines[0]["taken_s"] > 0
        assert [line["number"] for line in lines] == [1, 2, 3, 4, 5]
        assert not lines[-1]["has_height"]
        assert shared.read(5) is None or shared.read(5)[0][10, 10, 0] == 100
    rest, _ = running.communicate()
    assert running.returncode == 1
    assert list(json.loads(rest.splitlines()[-1])) == ["error"]


def test_a_rate_limits_how_often_a_live_sensor_measures(
    tmp_path: Path, process: ModuleType
) -> None:
    path = tmp_path / "frames"
    process.SharedFrames(path, 48, 64, create=True)
    with MjpegServer(live_sensor.send) as server:
        profile = live_sensor.profile(tmp_path, live_sensor.stream(server.url))
        given = options(str(profile), sim=False) | {"path": str(path), "fps": 5}
        running = started("measure", given)
        assert running.stdout is not None
        running.stdout.readline()
        lines = [json.loads(running.stdout.readline()) for _ in range(6)]
        running.communicate()
    stamps_s = [line["taken_s"] for line in lines]
    # the images come every 10 ms; none of these is an old one that waited
    assert min(np.diff(stamps_s[1:])) > 0.1
