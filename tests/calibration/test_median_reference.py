"""A calibration and a measurement without a recording of the undeformed sensor."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.command_line import refused, tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import InputError
from tactile_core.pipeline.opening import open_sensor
from tactile_core.quantities import HeightMap


def test_the_median_of_the_presses_calibrates_like_a_reference(lab: VirtualLab) -> None:
    made, usual = (
        calibrate(lab.profile, lab.presses, given, ball_diameter_mm=BALL_MM)
        for given in ("median", lab.reference)
    )
    assert made.score is not None
    assert usual.score is not None
    errors_deg = [
        one.score.summary()["normal_error_deg"]["mean"] for one in (made, usual) if one.score
    ]
    assert errors_deg[0] < errors_deg[1] + 0.5
    assert any("the reference is the median of" in note for note in made.notes)


def test_a_recording_is_measured_relative_to_its_median(lab: VirtualLab) -> None:
    options = {"bundle": lab.bundle, "input": lab.presses}
    with open_sensor(lab.profile_path, **options, reference="median") as sensor:
        peaks = [reading[HeightMap].mm.max() for reading in sensor.stream()]
        assert any("the reference is the median of" in note for note in sensor.notes)
    with open_sensor(lab.profile_path, **options, reference=lab.reference) as sensor:
        usual = [reading[HeightMap].mm.max() for reading in sensor.stream()]
    assert peaks == pytest.approx(usual, rel=0.1)


def test_a_camera_has_no_median(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="only a recording has a median; give --input"):
        open_sensor(lab.profile_path, bundle=lab.bundle, reference="median")
    said = refused(
        *("calibrate", lab.profile_path, "--live", "--sim", "--reference", "median"),
        *("--ball-diameter-mm", BALL_MM, "--out", lab.folder / "live"),
    )
    assert "only a recording has a median" in said


def test_the_commands_take_the_median(lab: VirtualLab, tmp_path: Path) -> None:
    done = tactile(
        *("calibrate", lab.profile_path, "--presses", lab.presses, "--reference", "median"),
        *("--ball-diameter-mm", BALL_MM, "--out", tmp_path / "bundle"),
    )
    assert done.returncode == 0, done.stderr
    assert "the reference is the median of" in done.stderr
    done = tactile(
        *("run", lab.profile_path, "--input", lab.presses, "--bundle", tmp_path / "bundle"),
        *("--reference", "median", "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert "the reference is the median of" in done.stderr
