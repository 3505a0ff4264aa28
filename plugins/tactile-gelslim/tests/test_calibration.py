"""Calibration with the package's profile, on virtual presses: no recording is available."""

from pathlib import Path

import pytest
from support.ball_calibration import error_deg, radius_ratio, used, virtually_calibrated
from support.uncalibrated import assert_coarse


def test_presses_of_a_virtual_ball_give_its_radius(tmp_path: Path) -> None:
    report = virtually_calibrated("gelslim4", tmp_path)
    assert used(report) >= 11
    assert error_deg(report) < 4
    assert radius_ratio(report) == pytest.approx(1, abs=0.1)


def test_an_uncalibrated_virtual_unit_is_measured_coarsely() -> None:
    assert_coarse("gelslim4")
