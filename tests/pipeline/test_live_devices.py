"""Only a live sensor creates and opens the camera and the light driver of a profile."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from support.command_line import tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core import open_sensor
from tactile_core.errors import DeviceError

FAKES = Path(__file__).resolve().parents[1] / "fakes" / "untouchable"
DEVICES = """\
camera: {use: untouchable.camera}
illumination: {driver: {use: untouchable.box}}
"""
SCRIPT = """\
steps:
  - indenter: {kind: sphere, diameter_mm: 8}
  - press: {depth_mm: 0.3}
"""


@dataclass(frozen=True)
class FakeDevices:
    """A profile with a fake camera and light driver, and the log of their calls."""

    profile: Path
    log: Path

    @property
    def calls(self) -> list[str]:
        """The calls of both devices, in order."""
        return self.log.read_text().splitlines()


@pytest.fixture
def devices(lab: VirtualLab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeDevices:
    monkeypatch.syspath_prepend(FAKES)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(FAKES), *sys.path]))
    log = tmp_path / "touched.txt"
    log.touch()
    monkeypatch.setenv("TOUCHED", str(log))
    profile = tmp_path / "live.yaml"
    profile.write_text(f"extends: {lab.profile_path}\n{DEVICES}")
    return FakeDevices(profile, log)


COMMANDS: dict[str, Callable[[VirtualLab, Path, Path], list[object]]] = {
    "replay": lambda lab, profile, out: [
        *("run", profile, "--bundle", lab.bundle, "--input", lab.presses),
        *("--reference", lab.reference, "--out", out),
    ],
    "first": lambda lab, profile, out: [
        *("run", profile, "--input", lab.presses, "--reference", "first", "--frames", 2),
    ],
    "workers": lambda lab, profile, out: [
        *("run", profile, "--bundle", lab.bundle, "--input", lab.presses, "--workers", 2),
        *("--frames", 4),
    ],
    "virtual": lambda lab, profile, out: [
        *("run", profile, "--sim", "--reference", "first", "--frames", 2),
    ],
    "simulate": lambda lab, profile, out: [
        *("simulate", profile, "--script", out.parent / "script.yaml", "--out", out),
    ],
    "calibrate": lambda lab, profile, out: [
        *("calibrate", profile, "--presses", lab.presses, "--reference", lab.reference),
        *("--ball-diameter-mm", BALL_MM, "--model", "core.polynomial", "--out", out),
    ],
    "bench": lambda lab, profile, out: [
        *("bench", profile, "--size", "160x120", "--calibration", "core.polynomial", "--json"),
    ],
    "validate": lambda lab, profile, out: ["validate", profile],
    "doctor": lambda lab, profile, out: ["doctor", profile, "--sim"],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_device_is_opened_without_a_live_sensor(
    lab: VirtualLab, devices: FakeDevices, tmp_path: Path, command: str
) -> None:
    (tmp_path / "script.yaml").write_text(SCRIPT)
    done = tactile(*COMMANDS[command](lab, devices.profile, tmp_path / "out"))
    assert done.returncode == 0, done.stderr
    assert devices.calls == []


def test_comparing_on_a_recording_opens_no_device(
    lab: VirtualLab, devices: FakeDevices, tmp_path: Path
) -> None:
    (tmp_path / "script.yaml").write_text(SCRIPT)
    made = tmp_path / "made"
    tactile("simulate", devices.profile, "--script", tmp_path / "script.yaml", "--out", made)
    words = ["compare", devices.profile, "--input", made / "frames", "--truth", made / "truth"]
    done = tactile(*words, "--bundle", lab.bundle, "--swap", "height=core.robust_poisson")
    assert done.returncode == 0, done.stderr
    assert devices.calls == []


def test_a_live_sensor_opens_the_lights_first_and_closes_them_last(
    lab: VirtualLab, devices: FakeDevices
) -> None:
    with (
        open_sensor(devices.profile, bundle=lab.bundle) as sensor,
        pytest.raises(DeviceError, match="no picture"),
    ):
        sensor.read()
    levels = {"red": 1.0, "green": 1.0, "blue": 1.0}
    assert devices.calls == [
        *("camera made", "box made", "box attached", "box opened", "camera opened"),
        *("box set to {}", f"box set to {levels}", "camera read"),
        *("box set to {}", "camera closed", "box set to {}", "box closed"),
    ]


def test_a_sensor_that_fails_to_open_leaves_camera_and_lights_closed(
    devices: FakeDevices,
) -> None:
    with pytest.raises(DeviceError, match="no picture"):
        open_sensor(devices.profile, reference="first")
    assert devices.calls[-4:] == ["box set to {}", "camera closed", "box set to {}", "box closed"]
