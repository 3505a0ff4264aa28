"""Virtual fingers in LeRobot, whose own code records them and reads them in its environment."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.dist_info import write_dist_info
from support.virtual_lab import VirtualLab

from tactile_core import ContactMask, HeightMap, SlipState, Wrench, load_profile, open_sensor
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit

ROOT = Path(__file__).resolve().parents[3]
PLUGIN = Path(__file__).resolve().parents[1]
SIDE = Path(__file__).parent / "lerobot_side"
# The oldest that has the interface, and one whose robots read heights as depth.
LEROBOTS = {"0.4.4": ".venv-lerobot", "0.6": ".venv-lerobot-3.12"}
FINGERS = {"left": "gelsight_mini", "right": "hex_fingertip_force"}


@pytest.fixture(params=LEROBOTS)
def lerobot(request: pytest.FixtureRequest) -> Path:
    """The interpreter of an environment that has LeRobot."""
    python = ROOT / LEROBOTS[request.param] / "bin/python"
    if not python.is_file():
        pytest.skip(f"LeRobot {request.param} is not installed; 'make test-exports' does so")
    return python


@pytest.fixture(scope="module")
def bundles(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A calibration of each finger."""
    folder = tmp_path_factory.mktemp("bundles")
    for name, profile in FINGERS.items():
        calibrate_virtual_unit(load_profile(profile, sim=True)).save(folder / name)
    return {name: folder / name for name in FINGERS}


def write_truth(path: Path, profile: str, bundle: Path) -> Path:
    """Write what each frame of the script shows, measured without LeRobot."""
    columns: dict[str, list[Any]] = {}
    with open_sensor(profile, bundle=bundle, sim=True) as sensor:
        for reading in sensor.stream():
            slip, wrench = reading.get(SlipState), reading[Wrench]
            one = {
                "rgb": reading.frame.pixels,
                "height_mm": reading[HeightMap].mm,
                "fx_n": wrench.fx_n,
                "fy_n": wrench.fy_n,
                "fz_n": wrench.fz_n,
                "tz_nmm": wrench.tz_nmm,
                "contact_area_mm2": reading[ContactMask].area_mm2,
            }
            if slip is not None:
                one |= {"slip_degree": slip.degree, "slip_known": slip.state != "unknown"}
            for key, value in one.items():
                columns.setdefault(key, []).append(value)
    np.savez(path, **{key: np.array(values) for key, values in columns.items()})
    return path


def run_in_lerobot(python: Path, script: str, folder: Path, task: dict[str, Any]) -> Any:
    """Run a script of LeRobot's side, which is given a task, and return what it prints."""
    site = folder / "site"
    site.mkdir()
    write_dist_info(PLUGIN, site)
    (folder / "task.json").write_text(json.dumps(task))
    paths = [os.environ.get("PYTHONPATH", ""), str(PLUGIN), str(site)]
    ended = subprocess.run(
        [python, SIDE / script, folder / "task.json"],
        capture_output=True,
        text=True,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, paths)),
            "HF_HUB_OFFLINE": "1",
            "HF_HOME": str(folder / "cache"),
        },
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout.splitlines()[-1])


def recorded_session(
    python: Path, folder: Path, bundles: dict[str, Path], *, seconds: float, videos: bool = False
) -> Any:
    """Record both fingers and a robot by LeRobot's own code; return what its loader gives."""
    fps = 15
    cameras = {
        name: {
            "profile": profile,
            "bundle": str(bundles[name]),
            "sim": True,
            "use_depth": True,
            "python": sys.executable,
            "warmup_s": 0.2,
            "fps": fps,
            "width": load_profile(profile).image.width_px,
            "height": load_profile(profile).image.height_px,
        }
        for name, profile in FINGERS.items()
    }
    truth = {
        name: str(write_truth(folder / f"{name}.npz", profile, bundles[name]))
        for name, profile in FINGERS.items()
    }
    task = {
        "root": str(folder / "data"),
        "seconds": seconds,
        "fps": fps,
        "videos": videos,
        "cameras": cameras,
        "truth": truth,
    }
    return run_in_lerobot(python, "record_session.py", folder, task)


def test_lerobot_loads_what_two_fingers_measured(
    lerobot: Path, bundles: dict[str, Path], tmp_path: Path
) -> None:
    found = recorded_session(lerobot, tmp_path, bundles, seconds=1.5)
    worst = found["worst"]
    assert found["frames"] == 22
    assert min(found["different_frames"].values()) > 3
    assert worst["pixel_levels"] == worst["number"] == worst["state"] == 0
    assert worst["time_s"] < 1e-6
    assert worst["height_um"] < 0.01
    assert found["deepest_mm"] > 0.1  # it was not the undeformed gel that agreed
    assert found["largest_n"] > 0.1
    assert {"jaw.pos", "left.fz_n", "right.fz_n", "right.slip_degree"} <= set(found["names"])
    assert "left.slip_degree" not in found["names"]  # the profile measures none
    assert {"observation.images.left", "observation.state", "action"} <= set(
        found["policy_features"]
    )
    assert "tactile_core" not in found["foreign"]


def test_what_goes_wrong_is_said_in_one_sentence(
    lerobot: Path, lab: VirtualLab, tmp_path: Path
) -> None:
    task = {
        "python": sys.executable,
        "profile": str(lab.profile_path),
        "bundle": str(lab.bundle),
        "no_height": "tactip",
    }
    said = run_in_lerobot(lerobot, "use_wrongly.py", tmp_path, task)
    sentences = {
        "no_height": ("ValueError", "the profile tactip has no step that measures height; leave"),
        "other_size": ("ValueError", "160 × 120 pixels, not 32 × 24; leave width and height out"),
        "no_interpreter": ("ValueError", "/absent/python cannot be started"),
        "no_core": ("ValueError", "ended with code 1; is tactile-core installed for /bin/false?"),
        "bad_script": ("ConnectionError", "absent.yaml"),
        "unconnected": ("DeviceNotConnectedError", "call connect() first"),
        "twice": ("DeviceAlreadyConnectedError", "is already connected"),
        "max_age": ("TimeoutError", "more than max_age_ms = 100; allow older ones"),
        "max_age_depth": ("TimeoutError", "more than max_age_ms = 100; allow older ones"),
        "no_newer": ("TimeoutError", "sent no new image within 100 ms"),
        "died": ("DeviceNotConnectedError", "was ended by signal 9; disconnect the camera"),
        "died_waiting": ("DeviceNotConnectedError", "was ended by signal 9"),
        "not_asked_for": ("RuntimeError", "configure it with use_depth=True"),
    }
    for key, (kind, words) in sentences.items():
        assert said[key][0] == kind, said[key]
        assert words in said[key][1], said[key]
        assert "\n" not in said[key][1]
    assert said["decoded"] == ["TactileCameraConfig", "there/bin/python", 15, False]
    assert said["arrays"] == [[120, 160, 3], "uint8", [120, 160, 1], "float32"]
    assert said["one_observation"]
    assert said["numbers_grow"]
    assert said["connected_again"] == [120, 160, 3]
    assert not said["left_open"]
    assert not said["connected_after_death"]
    assert not said["left_behind"]
    assert isinstance(said["find"], list)
