"""A calibration of many virtual units measures one that it has not seen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from support.command_line import refused, tactile
from support.uncalibrated import assert_coarse

from tactile_core.bundles.bundle import Bundle
from tactile_sim.starting_calibration import StartingCalibration, starting_calibration

SMALL = """\
extends: hex_fingertip_unmarked
name: small
image: {width_px: 160, height_px: 120, mm_per_px: 0.12}
gel: {thickness_mm: 2.5}
"""


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("design") / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def made(design: Path) -> StartingCalibration:
    return starting_calibration(design, units=5)


def test_an_unseen_unit_is_measured_within_a_quarter_of_the_depth(
    made: StartingCalibration, design: Path
) -> None:
    assert_coarse(design, made.bundle)


def test_the_score_is_of_units_that_were_left_out(made: StartingCalibration) -> None:
    radii = made.score.sphere_quartiles()
    assert radii is not None
    assert radii[1] == pytest.approx(1, abs=0.15)
    assert made.score.mean_deg < 0.3 * made.score.predict_flat_deg
    assert made.bundle.errors is not None


def test_it_has_no_reference_and_says_what_it_was_fitted_to(
    made: StartingCalibration, tmp_path: Path
) -> None:
    made.save(tmp_path / "start")
    loaded = Bundle.load(tmp_path / "start")
    assert loaded.reference is None
    assert loaded.manifest.starting is not None
    assert loaded.manifest.starting.of == "5 virtual units of small"
    sheet = (tmp_path / "start" / "data_sheet.txt").read_text()
    assert "5 virtual units" in sheet
    assert sum(path.stat().st_size for path in (tmp_path / "start").rglob("*")) < 100_000


def test_the_command_writes_it(design: Path, tmp_path: Path) -> None:
    quick = tmp_path / "quick.yaml"
    quick.write_text(f"extends: {design}\nname: quick\ncalibration: {{use: core.polynomial}}\n")
    done = tactile(
        "starting-calibration", quick, "--units", 5, "--out", tmp_path / "start", "--json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["held_out"]["presses"] > 40


def test_four_units_are_too_few(design: Path, tmp_path: Path) -> None:
    message = refused("starting-calibration", design, "--units", 4, "--out", tmp_path / "start")
    assert "5" in message


def test_the_bundle_of_a_unit_is_not_replaced(
    made: StartingCalibration, design: Path, tmp_path: Path
) -> None:
    manifest = made.bundle.manifest.model_copy(update={"starting": None})
    replace(made.bundle, manifest=manifest).save(tmp_path / "unit")
    message = refused("starting-calibration", design, "--out", tmp_path / "unit")
    assert "the bundle of a unit" in message
    assert Bundle.load(tmp_path / "unit").manifest.starting is None


def test_presses_of_a_real_unit_need_presses(design: Path, tmp_path: Path) -> None:
    message = refused(
        "starting-calibration", design, "--ball-diameter-mm", 4, "--out", tmp_path / "start"
    )
    assert "give --presses" in message
