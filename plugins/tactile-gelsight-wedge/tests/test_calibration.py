"""Calibrations with the package's profiles, on virtual presses and on recordings."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from support.command_line import tactile

from tactile_sim import VirtualStage
from tactile_sim.simulation import press_balls


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


@pytest.mark.parametrize("name", ["gelsight_wedge", "gelsight_wedge_unmarked"])
def test_presses_of_a_virtual_ball_give_its_radius(name: str, tmp_path: Path) -> None:
    rectified = tmp_path / "rectified.yaml"  # virtual images are rectified already
    rectified.write_text(f"extends: {name}\nname: rectified\nimage: {{warp: null}}\n")
    ball_mm = press_balls(VirtualStage(str(rectified)), tmp_path, count=12)
    report = calibrated(
        rectified, tmp_path / "presses", tmp_path / "reference", ball_mm, tmp_path / "bundle"
    )
    assert sum(press["used"] for press in report["presses"]) >= 11
    assert report["held_out"]["normal_error_deg"]["mean"] < 4
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("folder", "pattern", "reference"),
    [("wedge", "ball-*.jpg", "bg-0.jpg"), ("wedge_2", "presses/*.jpg", "background.jpg")],
)
def test_presses_of_a_real_ball_give_its_radius(
    recordings: Path, folder: str, pattern: str, reference: str, tmp_path: Path
) -> None:
    source = recordings / "three_colour" / folder
    if not source.is_dir():
        pytest.skip(f"there is no three_colour/{folder} among the recordings")
    presses = tmp_path / "presses"
    presses.mkdir()
    for path in source.glob(pattern):
        shutil.copy(path, presses)
    report = calibrated(
        "gelsight_wedge_portrait", presses, source / reference, 4.84, tmp_path / "bundle"
    )
    assert sum(press["used"] for press in report["presses"]) >= 40
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)
