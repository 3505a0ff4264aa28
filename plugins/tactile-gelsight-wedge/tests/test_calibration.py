"""Calibrations with the package's profiles, on virtual presses and on recordings."""

import shutil
from pathlib import Path

import pytest
from support.ball_calibration import calibrated, error_deg, radius_ratio, used, virtually_calibrated
from support.uncalibrated import assert_coarse


@pytest.mark.parametrize("name", ["gelsight_wedge", "gelsight_wedge_unmarked"])
def test_presses_of_a_virtual_ball_give_its_radius(name: str, tmp_path: Path) -> None:
    rectified = tmp_path / "rectified.yaml"  # virtual images are rectified already
    rectified.write_text(f"extends: {name}\nname: rectified\nimage: {{warp: null}}\n")
    report = virtually_calibrated(rectified, tmp_path)
    assert used(report) >= 11
    assert error_deg(report) < 4
    assert radius_ratio(report) == pytest.approx(1, abs=0.1)


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
    assert used(report) >= 40
    assert radius_ratio(report) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("name", ["gelsight_wedge", "gelsight_wedge_unmarked"])
def test_an_uncalibrated_virtual_unit_is_measured_coarsely(name: str) -> None:
    assert_coarse(name)


def test_an_uncalibrated_virtual_unit_with_small_images_is_measured_coarsely() -> None:
    # printed dots hide the steepest rim of a contact, so that it seems a tenth lower
    assert_coarse("gelsight_wedge_portrait", within=0.35)
