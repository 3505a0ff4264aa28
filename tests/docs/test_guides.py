"""The guides run as printed, from an empty folder."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from support.followed import ROOT, Reader
from support.virtual_lab import VirtualLab

from tactile_core.evaluation.demo import calibrated_virtually
from tactile_core.formats.images import write_png
from tactile_core.profiles.loader import load_profile
from tactile_core.sim.analytic_ball import BallPress
from tactile_core.sim.stage import VirtualStage

pytestmark = pytest.mark.pages

DOCS = ROOT / "docs"


def test_every_calibration_of_the_guide_runs_and_prints_the_quoted_output(tmp_path: Path) -> None:
    Reader(tmp_path).follow(DOCS / "how-to" / "calibrate.md")
    assert not (tmp_path / "wrong").exists()


def test_a_box_of_parts_becomes_a_height_map(tmp_path: Path) -> None:
    reader = Reader(tmp_path)
    reader.follow(DOCS / "tutorials" / "box-of-parts.md")
    depth_mm = float(reader.printed.split()[-3])
    with np.load(tmp_path / "results" / "marble.npz") as results:
        assert depth_mm == pytest.approx(float(results["height_mm"].max()), abs=0.006)
    marble = BallPress((150.0, 125.0), 8.0, 0.3).height_mm((240, 320), 0.0552)
    assert depth_mm == pytest.approx(marble.max(), rel=0.1)


def test_a_sensor_is_recorded_and_measured_again(tmp_path: Path) -> None:
    Reader(tmp_path).follow(DOCS / "how-to" / "record.md")
    assert {path.name for path in (tmp_path / "run").glob("[!.]*")} == {
        *(f"{number:06d}.npz" for number in range(4)),
        "recording.mcap",
    }


def test_force_is_measured(tmp_path: Path) -> None:
    calibrated_virtually(load_profile("hex_fingertip", sim=True)).save(tmp_path / "bundle")
    stage = VirtualStage("hex_fingertip")
    stage.indenter("sphere", diameter_mm=12)
    (tmp_path / "recording").mkdir()
    for number in range(2):
        write_png(tmp_path / "recording" / f"{number}.png", stage.frame().pixels)
        stage.press(depth_mm=0.4)
    true_n = stage.truth().wrench[2]
    reader = Reader(tmp_path)
    reader.follow(DOCS / "how-to" / "measure-force.md")
    before_n, pressed_n = (float(line.split()[2]) for line in reader.printed.splitlines()[-2:])
    assert before_n == 0
    assert pressed_n == pytest.approx(true_n, rel=0.15)


def test_a_recording_is_passed_on(tmp_path: Path) -> None:
    Reader(tmp_path).follow(DOCS / "how-to" / "pass-on-a-recording.md")


def test_a_plugin_is_installed_listed_and_conforms(tmp_path: Path) -> None:
    reader = Reader(tmp_path)
    reader.follow(ROOT / "plugins" / "README.md")
    assert "passed" in reader.printed


def test_the_estimator_of_the_guide_measures_and_conforms(lab: VirtualLab, tmp_path: Path) -> None:
    # the results of the guide to the first sensor: its profile, a bundle and a marble
    shutil.copy(lab.profile_path, tmp_path / "my_sensor.yaml")
    shutil.copytree(lab.bundle, tmp_path / "bundle")
    lab.save(tmp_path / "recording" / "marble.png", BallPress((90.0, 55.0), 6.0, 0.7))
    reader = Reader(tmp_path)
    reader.follow(DOCS / "tutorials" / "first-estimator.md")
    assert "passed" in reader.printed
