"""The guides run as printed, from an empty folder."""

import shutil
from pathlib import Path

from support.followed import ROOT, Reader
from support.virtual_lab import VirtualLab

from tactile_core.sim.analytic_ball import BallPress

DOCS = ROOT / "docs"


def test_every_calibration_of_the_guide_runs_and_prints_the_quoted_output(tmp_path: Path) -> None:
    Reader(tmp_path).follow(DOCS / "how-to" / "calibrate.md")
    assert not (tmp_path / "wrong").exists()


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
