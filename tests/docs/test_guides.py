"""The guides run as printed, from an empty folder."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.followed import ROOT, Reader
from support.virtual_lab import VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_core.formats.images import write_png
from tactile_core.profiles.loader import load_profile
from tactile_sim.stage import VirtualStage

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
    calibrate_virtual_unit(load_profile("hex_fingertip", sim=True)).save(tmp_path / "bundle")
    stage = VirtualStage("hex_fingertip")
    stage.indenter("sphere", diameter_mm=12)
    (tmp_path / "recording").mkdir()
    for number in range(2):
        write_png(tmp_path / "recording" / f"{number}.png", stage.frame().pixels)
        stage.press(depth_mm=0.4)
    true_n = stage.truth().wrench[2]
    (tmp_path / "forces").mkdir()
    for number, diameter_mm in enumerate((8.0, 12.0, 16.0)):
        _pressed_with_forces(tmp_path, f"press_{number}", diameter_mm)
    reader = Reader(tmp_path)
    page = (DOCS / "how-to" / "measure-force.md").read_text()
    elastic, rest = page.split("## Newtons")
    fitted, load = rest.split("## A load")
    printed = []
    for part in (elastic, fitted, load):
        (tmp_path / "part.md").write_text(part)
        reader.follow(tmp_path / "part.md")
        printed.append(reader.printed.splitlines()[-2:])
    before_n, pressed_n = (float(line.split()[2]) for line in printed[0])
    assert before_n == 0
    assert pressed_n == pytest.approx(true_n, rel=0.15)
    before, pressed = (json.loads(line)["wrench"] for line in printed[1])
    assert before["fz_n"] == pytest.approx(0, abs=0.05 * true_n)
    assert pressed["fz_n"] == pytest.approx(true_n, rel=0.2)
    assert printed[2][0] == "load 0.0000"
    assert float(printed[2][1].split()[1]) > 0.005


def _pressed_with_forces(folder: Path, name: str, diameter_mm: float) -> None:
    """Press a ball deeper and deeper, shear it, and write the forces beside the frames."""
    stage = VirtualStage("hex_fingertip")
    stage.indenter("sphere", diameter_mm=diameter_mm)
    (folder / "recordings" / name).mkdir(parents=True)
    lines = ["frame,fx_n,fy_n,fz_n,tz_nmm"]
    for number in range(6):
        write_png(folder / "recordings" / name / f"{number}.png", stage.frame().pixels)
        lines.append(f"{number}," + ",".join(str(float(one)) for one in stage.truth().wrench))
        if number < 3:
            stage.press(depth_mm=0.16 * (number + 1))
        else:
            stage.shear(dx_mm=0.06, dy_mm=0.04)
    (folder / "forces" / f"{name}.csv").write_text("\n".join(lines))


def test_a_recording_is_passed_on(tmp_path: Path) -> None:
    Reader(tmp_path).follow(DOCS / "how-to" / "pass-on-a-recording.md")


def test_a_sensor_is_published_to_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")
    from support.ros2_subscriber import LOOPBACK

    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    Reader(tmp_path).follow(DOCS / "how-to" / "in-ros2.md")


def test_a_plugin_is_installed_listed_and_conforms(tmp_path: Path) -> None:
    reader = Reader(tmp_path)
    reader.follow(ROOT / "plugins" / "README.md")
    assert "passed" in reader.printed


def test_a_table_of_another_program_is_imported_and_measures(tmp_path: Path) -> None:
    # the beginning of the guide to the first sensor: its images and its profile
    first = (DOCS / "tutorials" / "first-sensor.md").read_text()
    (tmp_path / "part.md").write_text(first.split("## 2.")[0])
    reader = Reader(tmp_path)
    reader.follow(tmp_path / "part.md")
    reader.follow(DOCS / "tutorials" / "first-importer.md")
    assert "passed" in reader.printed


def test_the_command_of_the_guide_prints_depths(lab: VirtualLab, tmp_path: Path) -> None:
    _finish_first_sensor(lab, tmp_path)
    reader = Reader(tmp_path)
    used, tested = (DOCS / "tutorials" / "first-command.md").read_text().split("## 4.")
    (tmp_path / "part.md").write_text(used)
    reader.follow(tmp_path / "part.md")
    assert re.search(r"^marble: 1\.\d mm$", reader.printed, re.MULTILINE)
    (tmp_path / "part.md").write_text(tested)
    reader.follow(tmp_path / "part.md")
    assert "passed" in reader.printed


def test_the_estimator_of_the_guide_measures_and_conforms(lab: VirtualLab, tmp_path: Path) -> None:
    _finish_first_sensor(lab, tmp_path)
    reader = Reader(tmp_path)
    reader.follow(DOCS / "tutorials" / "first-estimator.md")
    assert "passed" in reader.printed


def _finish_first_sensor(lab: VirtualLab, folder: Path) -> None:
    """Make the results of the guide to the first sensor: its profile, a bundle and a marble."""
    shutil.copy(lab.profile_path, folder / "my_sensor.yaml")
    shutil.copytree(lab.bundle, folder / "bundle")
    lab.save(folder / "recording" / "marble.png", BallPress((90.0, 55.0), 6.0, 0.7))
