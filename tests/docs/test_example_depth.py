"""The example of a calibration that measures depth directly works with every command."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from support.command_line import tactile
from support.dist_info import write_dist_info
from support.height_lab import make_height_lab
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.fitting import calibrate
from tactile_core.profiles.loader import load_profile
from tactile_sim.optics.rig import render

pytestmark = pytest.mark.pages

PROJECT = Path(__file__).resolve().parents[2] / "examples" / "tactile-example-depth"
MODULE = "tactile_example_depth"
MODEL = "example_depth.ridge"
HELD_OUT = BallPress((88.0, 66.0), BALL_MM, 0.8)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    """Make the example importable as if pip had installed it; return its folders."""
    site = tmp_path_factory.mktemp("site")
    write_dist_info(PROJECT, site)
    folders = [PROJECT, site]
    with pytest.MonkeyPatch.context() as patch:
        for folder in folders:
            patch.syspath_prepend(folder)
        yield folders
    for name in [name for name in sys.modules if name.partition(".")[0] == MODULE]:
        del sys.modules[name]


@pytest.fixture(scope="module")
def profile(
    installed: list[Path], lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Write a profile of the virtual sensor with this calibration and without integration."""
    path = tmp_path_factory.mktemp("profile") / "deep.yaml"
    path.write_text(
        f"extends: {lab.profile_path}\nname: deep\ncalibration: {{use: {MODEL}}}\n"
        f"estimators: {{height: null}}\n"
    )
    return path


@pytest.fixture(scope="module")
def calibrated(profile: Path, lab: VirtualLab) -> tuple[Path, dict[str, Any]]:
    """Calibrate with the command; return the bundle and the JSON summary."""
    bundle = profile.parent / "bundle"
    done = tactile(
        *("calibrate", profile, "--presses", lab.presses, "--reference", lab.reference),
        *("--ball-diameter-mm", BALL_MM, "--out", bundle, "--json"),
    )
    assert done.returncode == 0, done.stderr
    return bundle, json.loads(done.stdout)


def test_circles_are_found_and_the_held_out_score_has_normals_and_height(
    calibrated: tuple[Path, dict[str, Any]],
) -> None:
    _, summary = calibrated
    assert summary["model"] == MODEL
    assert sum(press["used"] for press in summary["presses"]) == 10
    held_out = summary["held_out"]
    assert held_out["presses"] == 10
    assert held_out["normal_error_deg"]["mean"] < 0.3 * held_out["predict_flat_deg"]
    assert held_out["height_rmse_mm"] < 0.1 * HELD_OUT.depth_mm


def test_the_report_shows_measured_against_true_normals(
    calibrated: tuple[Path, dict[str, Any]],
) -> None:
    report = (calibrated[0] / "report.html").read_text(encoding="utf-8")
    assert MODEL in report
    assert "pitch in degrees: measured (vertical) against true (horizontal)" in report


def without_scores(warnings: list[str]) -> list[str]:
    """Leave out what the calibration says of its score: a network this small may miss a tenth."""
    return [each for each in warnings if "said of this bundle: spheres" not in each]


def test_a_held_out_press_is_measured_and_written_in_every_format(
    calibrated: tuple[Path, dict[str, Any]], profile: Path, lab: VirtualLab, tmp_path: Path
) -> None:
    image = lab.save(tmp_path / "held_out.png", HELD_OUT)
    done = tactile(
        *("run", profile, "--bundle", calibrated[0], "--input", image, "--out", tmp_path / "out"),
        *("--save", "npz,tmd,png,ply", "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert without_scores(json.loads(done.stdout)["warnings"]) == []
    section = lab.profile.image
    true = HELD_OUT.height_mm((section.height_px, section.width_px), section.mm_per_px)
    with np.load(tmp_path / "out" / "held_out.npz") as data:
        height, contact = data["height_mm"], data["contact"]
    on_ball = true > true.max() - HELD_OUT.depth_mm
    error = (height - true)[on_ball]
    assert error.std() < 0.15 * HELD_OUT.depth_mm
    # around a contact the analytic surface is higher than the gel model of the training heights,
    # so the error outside has a wider tolerance
    assert np.abs(height[true < 0.01]).mean() < 0.2 * HELD_OUT.depth_mm
    assert contact[66, 88]
    assert not contact[:10].any()
    written = {path.suffix for path in (tmp_path / "out").glob("held_out*")}
    assert written == {".npz", ".tmd", ".png", ".ply"}


def test_a_step_that_needs_gradients_is_left_out_with_a_warning(
    calibrated: tuple[Path, dict[str, Any]], profile: Path, lab: VirtualLab, tmp_path: Path
) -> None:
    image = lab.save(tmp_path / "held_out.png", HELD_OUT)
    integrating = tmp_path / "deep.yaml"
    text = profile.read_text().replace("{height: null}", "{height: {use: core.poisson}}")
    integrating.write_text(text)
    done = tactile("run", integrating, "--bundle", calibrated[0], "--input", image, "--json")
    assert done.returncode == 0, done.stderr
    reading = json.loads(done.stdout)
    assert reading["max_height_mm"] > 0.5
    assert without_scores(reading["warnings"]) == [
        "step 'height' needs Gradients, but this calibration provides a HeightMap directly; the "
        "step is left out"
    ]


@pytest.mark.usefixtures("installed")
def test_depth_can_be_calibrated_with_a_height_map(tmp_path: Path) -> None:
    relief = make_height_lab(tmp_path)
    done = tactile(
        *("calibrate", relief.profile, "--model", MODEL, "--presses", relief.press),
        *("--reference", relief.undeformed, "--target", relief.tmd, "--out", tmp_path / "bundle"),
        "--json",
    )
    assert done.returncode == 0, done.stderr
    held_out = json.loads(done.stdout)["held_out"]
    assert held_out["normal_error_deg"]["mean"] < held_out["predict_flat_deg"]
    assert held_out["height_rmse_mm"] < 0.5 * relief.height_mm.std()


def test_bench_times_the_stages(profile: Path) -> None:
    done = tactile("bench", profile, "--json")
    assert done.returncode == 0, done.stderr
    (bench,) = json.loads(done.stdout)["benches"]
    assert bench["model"] == MODEL
    assert [stage["stage"] for stage in bench["stages"]][:2] == ["acquire", "slopes"]


def test_its_own_tests_pass(installed: list[Path]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
        cwd=PROJECT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, installed), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_gel_that_darkens_with_depth_is_calibrated_and_scored(
    installed: list[Path], tmp_path: Path
) -> None:
    profile = load_profile("example_darkness")
    shape, scale = (profile.image.height_px, profile.image.width_px), profile.image.mm_per_px
    lines = ["file,centre_x_px,centre_y_px,contact_radius_px"]
    for number, (x, y) in enumerate([(110, 90), (200, 110), (150, 150), (210, 160), (120, 140)]):
        press = BallPress((float(x), float(y)), 6.0, 0.6)
        image = render(profile, press.height_mm(shape, scale), seed=number + 1)
        write(tmp_path / "presses" / f"{number}.png", image)
        lines.append(f"{number}.png,{x},{y},{press.contact_radius_mm / scale}")
    write(tmp_path / "reference.png", render(profile, np.zeros(shape)))
    (tmp_path / "labels.csv").write_text("\n".join(lines))
    made = calibrate(
        profile,
        tmp_path / "presses",
        tmp_path / "reference.png",
        ball_diameter_mm=6.0,
        labels=tmp_path / "labels.csv",
    )
    assert made.bundle.manifest.model == "example_depth.darkness"
    held_out = made.summary(tmp_path)["held_out"]
    assert held_out["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.1)
    assert held_out["height_rmse_mm"] < 0.1


def write(path: Path, rgb: np.ndarray) -> None:
    path.parent.mkdir(exist_ok=True)
    cv2.imwrite(str(path), rgb[..., ::-1])
