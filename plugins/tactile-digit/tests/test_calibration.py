"""Calibrations with the package's profile, on virtual presses and on recordings."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from support.command_line import tactile

from tactile_sim import VirtualStage
from tactile_sim.simulation import press_balls


@pytest.fixture
def rectified(tmp_path: Path) -> Path:
    """A revision for images that another program has turned upright."""
    path = tmp_path / "rectified.yaml"
    path.write_text("extends: digit\nname: rectified\nimage: {rotate_deg: 0, mm_per_px: 0.0511}\n")
    return path


def calibrated(
    profile: Path | str, presses: Path, reference: Path, ball_mm: float, out: Path
) -> dict[str, Any]:
    done = tactile(
        *("calibrate", profile, "--presses", presses, "--reference", reference),
        *("--ball-diameter-mm", ball_mm, "--out", out, "--json"),
    )
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def test_presses_of_a_virtual_ball_give_its_radius(rectified: Path, tmp_path: Path) -> None:
    ball_mm = press_balls(VirtualStage(str(rectified)), tmp_path, count=12)
    report = calibrated(
        rectified, tmp_path / "presses", tmp_path / "reference", ball_mm, tmp_path / "bundle"
    )
    assert sum(press["used"] for press in report["presses"]) >= 11
    assert report["held_out"]["normal_error_deg"]["mean"] < 4
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)


@pytest.mark.recordings
def test_presses_of_a_real_ball_give_its_radius(recordings: Path, tmp_path: Path) -> None:
    folder = recordings / "digit/ball_presses"
    shutil.copytree(folder, tmp_path / "presses", ignore=shutil.ignore_patterns("background.png"))
    report = calibrated(
        "digit", tmp_path / "presses", folder / "background.png", 4.7, tmp_path / "bundle"
    )
    assert sum(press["used"] for press in report["presses"]) >= 18
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)
