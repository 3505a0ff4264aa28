"""The fixed contract of the command line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from support.command_line import refused, tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress


@pytest.fixture(scope="module")
def ran(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run the command on two held-out images; return the folder with its results."""
    folder = tmp_path_factory.mktemp("ran")
    lab.save(folder / "in" / "ball.png", BallPress((70.0, 62.0), BALL_MM, 0.8))
    lab.save(folder / "in" / "rest.png", None)
    done = tactile(
        *("run", lab.profile_path, "--bundle", lab.bundle, "--input", folder / "in"),
        *("--out", folder / "out", "--save", "npz,tmd,png,ply", "--json"),
    )
    assert done.returncode == 0, done.stderr
    (folder / "lines").write_text(done.stdout)
    return folder


def test_help_names_every_command() -> None:
    done = tactile("--help")
    assert done.returncode == 0
    commands = "demo run calibrate compare bench profiles plugins validate schema doctor"
    for command in commands.split():
        assert command in done.stdout


def test_run_prints_a_json_line_per_observation(ran: Path) -> None:
    lines = [json.loads(line) for line in (ran / "lines").read_text().splitlines()]
    assert [line["source"] for line in lines] == ["ball", "rest"]
    assert {
        "sequence",
        "timestamp_s",
        "latency_ms",
        "relative",
        "contact_area_mm2",
        "max_height_mm",
        "wrench",
        "slip",
        "markers",
        "warnings",
    } <= set(lines[0])
    assert lines[0]["contact_area_mm2"] > 1
    assert lines[1]["contact_area_mm2"] == 0


def test_run_writes_every_array_of_the_contract(ran: Path) -> None:
    with np.load(ran / "out" / "ball.npz") as data:
        assert data["height_mm"].dtype == np.float32
        assert data["height_mm"].shape == (120, 160)
        assert data["gradients"].dtype == np.float32
        assert data["gradients"].shape == (120, 160, 2)
        assert data["contact"].dtype == bool
        assert data["valid"].dtype == bool
        assert float(data["mm_per_px"]) == pytest.approx(0.1245)
        assert all(np.isfinite(data[name]).all() for name in data)


def test_run_writes_files_that_other_tools_open(ran: Path) -> None:
    names = {path.name for path in (ran / "out").iterdir()}
    assert {f"ball{end}" for end in (".npz", ".tmd", ".png", "_normals.png", ".ply")} <= names


def test_calibrate_json_has_one_entry_per_press(lab: VirtualLab, tmp_path: Path) -> None:
    done = tactile(
        *("calibrate", lab.profile_path, "--presses", lab.presses, "--reference", lab.reference),
        *("--ball-diameter-mm", BALL_MM, "--model", "core.polynomial", "--out", tmp_path / "b"),
        "--json",
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["model"] == "core.polynomial"
    assert len(summary["presses"]) == 10
    assert all(press["used"] for press in summary["presses"])
    assert summary["held_out"]["normal_error_deg"]["mean"] < 3
    assert summary["held_out"]["predict_flat_deg"] > 10
    assert 0 < summary["coverage"]["image_fraction"] < 1
    assert (tmp_path / "b" / "report.html").exists()


def test_a_text_file_named_png_is_refused(lab: VirtualLab, tmp_path: Path) -> None:
    (tmp_path / "note.png").write_text("hello")
    message = refused("run", lab.profile_path, "--bundle", lab.bundle, "--input", tmp_path)
    assert "note.png" in message


def test_an_empty_folder_is_refused(lab: VirtualLab, tmp_path: Path) -> None:
    refused("run", lab.profile_path, "--bundle", lab.bundle, "--input", tmp_path)


def test_a_missing_folder_is_refused(lab: VirtualLab, tmp_path: Path) -> None:
    refused("run", lab.profile_path, "--bundle", lab.bundle, "--input", tmp_path / "gone")


def test_another_units_bundle_is_refused(lab: VirtualLab) -> None:
    message = refused(
        *("run", lab.profile_path, "--bundle", lab.bundle, "--input", lab.presses),
        *("--serial", "1234"),
    )
    assert "serial 0007, not 1234" in message


def test_a_serial_that_is_a_path_is_refused(lab: VirtualLab) -> None:
    refused("run", lab.profile_path, "--input", lab.presses, "--serial", "../x")


def test_an_unknown_output_format_is_refused(lab: VirtualLab, tmp_path: Path) -> None:
    message = refused(
        *("run", lab.profile_path, "--input", lab.presses, "--out", tmp_path / "o"),
        *("--save", "stl"),
    )
    assert "npz, tmd, png, ply" in message
    assert not (tmp_path / "o").exists()


def test_an_unknown_profile_suggests_the_nearest() -> None:
    assert "hex_fingertip" in refused("run", "hex_fingertp", "--input", ".")


def test_an_unknown_option_is_refused() -> None:
    refused("run", "hex_fingertip", "--frobnicate")


def test_a_missing_ball_diameter_is_requested(lab: VirtualLab, tmp_path: Path) -> None:
    message = refused(
        *("calibrate", lab.profile_path, "--presses", lab.presses),
        *("--reference", lab.reference, "--out", tmp_path / "b"),
    )
    assert "--ball-diameter-mm" in message
    assert not (tmp_path / "b").exists()


def test_presses_without_contact_are_refused(lab: VirtualLab, tmp_path: Path) -> None:
    for i in range(3):
        lab.save(tmp_path / "rest" / f"{i}.png", None, seed=i)
    refused(
        *("calibrate", lab.profile_path, "--presses", tmp_path / "rest"),
        *("--reference", lab.reference, "--ball-diameter-mm", 4, "--out", tmp_path / "b"),
    )
    assert not (tmp_path / "b").exists()


def test_debug_shows_the_traceback() -> None:
    done = tactile("run", "no_such_profile", "--debug")
    assert "Traceback" in done.stderr


def test_a_missing_tare_frame_is_reported(lab: VirtualLab, tmp_path: Path) -> None:
    lab.save(tmp_path / "in" / "rest.png", None)
    done = tactile(
        *("run", lab.profile_path, "--bundle", lab.bundle, "--input", tmp_path / "in"),
        *("--tare-frame", 7, "--json"),
    )
    assert done.returncode == 2
    assert "--tare-frame 7" in done.stderr


def test_the_columns_of_the_profiles_stand_apart() -> None:
    rows = tactile("profiles").stdout.splitlines()
    assert {len(re.split(r" {2,}", row)) for row in rows} == {3}
    assert "plugin gelsight_mini" in {re.split(r" {2,}", row)[1] for row in rows}


def test_validate_names_the_property_of_the_gel_that_a_step_needs(tmp_path: Path) -> None:
    text = "extends: hex_fingertip_force\nname: soft\ngel: {shear_modulus_mpa: null}\n"
    (tmp_path / "soft.yaml").write_text(text)
    done = tactile("validate", str(tmp_path / "soft.yaml"))
    assert done.returncode == 2
    assert "soft.yaml: core.force_elastic needs" in done.stderr
    assert "gel.shear_modulus_mpa" in done.stderr


def test_validate_accepts_markers_that_are_measured_in_a_reference(tmp_path: Path) -> None:
    (tmp_path / "dots.yaml").write_text(
        "extends: hex_fingertip\nname: dots\ngel: {markers: auto}\n"
    )
    done = tactile("validate", str(tmp_path / "dots.yaml"))
    assert done.returncode == 0, done.stderr


def test_validate_and_doctor_report_steps_that_form_no_chain(tmp_path: Path) -> None:
    twice = tmp_path / "twice.yaml"
    twice.write_text(
        "schema: 1\nextends: hex_fingertip\nname: twice\nestimators: {again: {use: core.poisson}}\n"
    )
    for command in ("validate", "doctor"):
        done = tactile(command, str(twice))
        assert done.returncode == 2
        assert "both provide HeightMap; keep one" in done.stderr


def test_several_workers_print_the_same_lines_as_one_and_refuse_a_tare(lab: VirtualLab) -> None:
    words = ["run", lab.profile_path, "--bundle", lab.bundle, "--input", lab.presses, "--json"]
    alone, shared = (
        [json.loads(line) for line in tactile(*words, *more).stdout.splitlines()]
        for more in ((), ("--workers", "2"))
    )
    assert [line["source"] for line in shared] == [line["source"] for line in alone]
    for one, other in zip(alone, shared, strict=True):
        assert other["max_height_mm"] == pytest.approx(one["max_height_mm"], abs=1e-5)
    message = refused(*words, "--workers", "2", "--tare-frame", "1")
    assert "use one worker" in message
