"""Calibrations with the package's profile, on virtual presses and on recordings."""

import shutil
from pathlib import Path

import pytest
from support.ball_calibration import calibrated, error_deg, radius_ratio, used, virtually_calibrated
from support.uncalibrated import assert_coarse


@pytest.mark.parametrize("name", ["digit", "digit_sequential"])
def test_presses_of_a_virtual_ball_give_its_radius(name: str, tmp_path: Path) -> None:
    rectified = tmp_path / "rectified.yaml"  # virtual images are rectified already
    rectified.write_text(f"extends: {name}\nname: rectified\nimage: {{rotate_deg: 0}}\n")
    report = virtually_calibrated(rectified, tmp_path)
    assert used(report) >= 11
    assert error_deg(report) < 4
    assert radius_ratio(report) == pytest.approx(1, abs=0.1)


@pytest.mark.recordings
def test_presses_of_a_real_ball_give_its_radius(recordings: Path, tmp_path: Path) -> None:
    folder = recordings / "digit/ball_presses"
    shutil.copytree(folder, tmp_path / "presses", ignore=shutil.ignore_patterns("background.png"))
    report = calibrated(
        "digit", tmp_path / "presses", folder / "background.png", 4.7, tmp_path / "bundle"
    )
    assert used(report) >= 18
    assert radius_ratio(report) == pytest.approx(1, abs=0.1)


def test_an_uncalibrated_virtual_unit_is_measured_coarsely() -> None:
    assert_coarse("digit")
