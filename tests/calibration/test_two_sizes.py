"""Presses of two balls in one set."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.result import Calibrated
from tactile_core.errors import InputError

pytestmark = pytest.mark.headline

LARGE_MM = 6.0
CENTRES_PX = [(60.0, 45.0), (100.5, 70.0), (80.0, 60.5), (110.0, 40.5), (55.0, 75.0), (95.0, 55.0)]


@pytest.fixture(scope="module")
def presses(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The laboratory's presses of one ball, and a folder of a larger one."""
    folder = tmp_path_factory.mktemp("sizes")
    shutil.copytree(lab.presses, folder / "small")
    for number, centre in enumerate(CENTRES_PX):
        press = BallPress(centre, LARGE_MM, 1.2)
        lab.save(folder / "large" / f"press_{number}.png", press, seed=50 + number)
    (folder / "catalog.csv").write_text(
        f"experiment_reldir,diameter(mm)\nsmall,{BALL_MM}\nlarge,{LARGE_MM}\n"
    )
    return folder


@pytest.fixture(scope="module")
def made(lab: VirtualLab, presses: Path) -> Calibrated:
    return calibrate(lab.profile, presses, lab.reference, model="core.polynomial")


def test_the_circles_of_both_sizes_are_found(made: Calibrated) -> None:
    assert [press.ball_diameter_mm for press in made.presses] == [BALL_MM] * 10 + [LARGE_MM] * 6
    assert all(press.used for press in made.presses)
    large = np.array([press.centre_px for press in made.presses[10:]])
    assert np.abs(large - CENTRES_PX).max() < 0.5
    assert made.presses[10].file == "large/press_0.png"


def test_a_size_is_measured_with_a_calibration_on_the_other(made: Calibrated) -> None:
    assert made.score is not None
    assert made.score.left_out_size_ratio == pytest.approx(1, abs=0.08)
    assert "left out" in made.score.sentences(made.coverage())[1]
    assert made.notes == ()


def test_both_sizes_are_in_report_and_manifest(made: Calibrated, tmp_path: Path) -> None:
    made.save(tmp_path / "b")
    assert Bundle.load(tmp_path / "b").manifest.ball_diameters_mm == (BALL_MM, LARGE_MM)
    assert f"balls of {BALL_MM:g} and {LARGE_MM:g} mm" in (tmp_path / "b/report.html").read_text()


def test_a_size_that_is_wrong_is_doubted(lab: VirtualLab, presses: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong"
    shutil.copytree(presses, wrong)
    (wrong / "catalog.csv").write_text(
        f"experiment_reldir,diameter(mm)\nsmall,{BALL_MM}\nlarge,{1.4 * LARGE_MM}\n"
    )
    made = calibrate(lab.profile, wrong, lab.reference, model="core.polynomial")
    assert any("ball size that was left out" in note for note in made.notes)


def test_the_option_holds_for_all_that_the_catalogue_does_not_list(
    lab: VirtualLab, presses: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "mixed"
    shutil.copytree(presses / "small", folder)
    shutil.copy(presses / "large" / "press_0.png", folder / "z_large.png")
    (folder / "catalog.csv").write_text(f"file,diameter_mm\nz_large.png,{LARGE_MM}\n")
    with pytest.raises(InputError, match="no diameter of the ball in press_0"):
        calibrate(lab.profile, folder, lab.reference)
    made = calibrate(
        lab.profile,
        folder,
        lab.reference,
        ball_diameter_mm=BALL_MM,
        model="core.polynomial",
        scored=False,
    )
    assert [press.ball_diameter_mm for press in made.presses] == [BALL_MM] * 10 + [LARGE_MM]
