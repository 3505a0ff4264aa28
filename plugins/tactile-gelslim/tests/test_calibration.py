"""Calibration with the package's profile, on virtual presses: no recording is available."""

import json
from pathlib import Path

import pytest
from support.command_line import tactile

from tactile_sim import VirtualStage
from tactile_sim.simulation import press_balls


def test_presses_of_a_virtual_ball_give_its_radius(tmp_path: Path) -> None:
    ball_mm = press_balls(VirtualStage("gelslim4"), tmp_path, count=12)
    done = tactile(
        *("calibrate", "gelslim4", "--presses", tmp_path / "presses"),
        *("--reference", tmp_path / "reference", "--ball-diameter-mm", ball_mm),
        *("--out", tmp_path / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert sum(press["used"] for press in report["presses"]) >= 11
    assert report["held_out"]["normal_error_deg"]["mean"] < 4
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)
