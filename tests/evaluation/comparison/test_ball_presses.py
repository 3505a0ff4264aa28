"""Calibrations side by side on presses of a ball."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.command_line import refused, tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.errors import InputError
from tactile_core.evaluation.comparison.ball_presses import compare_on_presses


@pytest.fixture(scope="module")
def wrong(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle that was fitted with a ball of twice the diameter."""
    folder = tmp_path_factory.mktemp("wrong") / "bundle"
    calibrate(
        lab.profile,
        lab.presses,
        lab.reference,
        ball_diameter_mm=2 * BALL_MM,
        model="core.polynomial",
        scored=False,
    ).bundle.save(folder)
    return folder


def test_the_calibration_of_the_right_ball_has_its_radius_and_the_wrong_one_has_not(
    lab: VirtualLab, wrong: Path
) -> None:
    found = compare_on_presses(
        lab.profile_path,
        presses=lab.presses,
        ball_diameter_mm=BALL_MM,
        bundle=lab.bundle,
        swaps=[("calibration", str(wrong))],
        reference=lab.reference,
    )
    assert found.used == found.presses
    right, false = (score.summary() for score in found.scores)
    assert right["variant"] == "as it is"
    assert right["model"] == Bundle.load(lab.bundle).manifest.model
    assert right["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.03)
    assert right["depth_ratio"]["median"] == pytest.approx(1, abs=0.15)
    assert false["sphere_radius_ratio"]["median"] == pytest.approx(2, abs=0.2)
    assert right["normal_error_deg"]["mean"] < 0.5 * false["normal_error_deg"]["mean"]


def test_the_command_prints_one_row_or_entry_per_calibration(lab: VirtualLab, wrong: Path) -> None:
    words = [
        *("compare", lab.profile_path, "--presses", lab.presses, "--reference", "median"),
        *("--ball-diameter-mm", BALL_MM, "--bundle", lab.bundle),
        *("--swap", f"calibration={wrong}"),
    ]
    done = tactile(*words)
    assert done.returncode == 0, done.stderr
    assert "the reference is the median of" in done.stderr
    header, *rows = done.stdout.splitlines()
    assert "sphere / ball" in header
    assert [row.split()[0] for row in rows] == ["as", f"calibration={wrong}"]
    found = json.loads(tactile(*words, "--json").stdout)
    assert [one["imported"] for one in found["variants"]] == [False, False]


def test_without_any_calibration_there_is_nothing_to_compare(lab: VirtualLab) -> None:
    with pytest.raises(InputError, match="give --bundle or --swap calibration=FOLDER"):
        compare_on_presses(
            lab.profile_path,
            presses=lab.presses,
            ball_diameter_mm=BALL_MM,
            reference=lab.reference,
        )


def test_presses_and_a_truth_exclude_each_other(lab: VirtualLab) -> None:
    said = refused("compare", lab.profile_path, "--presses", lab.presses, "--truth", lab.folder)
    assert "leave --input, --truth and --out out" in said
    assert "or --presses and --ball-diameter-mm" in refused("compare", lab.profile_path)
