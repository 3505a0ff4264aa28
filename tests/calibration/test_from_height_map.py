"""Calibration with a height map as target: virtual lights, and a real grooved part."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.command_line import refused, tactile
from support.height_lab import AZIMUTHS_DEG, HEIGHT, MM_PER_PX, HeightLab, make_height_lab

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.result import Calibrated
from tactile_core.errors import InputError
from tactile_core.formats.tmd import read_tmd
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.quantities import Gradients

Array = NDArray[np.float64]
HALF = slice(0, HEIGHT // 2)
GROOVE = Path(__file__).resolve().parents[2] / "examples" / "groove.yaml"


@pytest.fixture(scope="module")
def height_lab(tmp_path_factory: pytest.TempPathFactory) -> HeightLab:
    return make_height_lab(tmp_path_factory.mktemp("height_lab"))


@pytest.fixture(scope="module")
def fitted(height_lab: HeightLab) -> Calibrated:
    """Fitted to the upper half of the map, with an image of the undeformed sensor."""
    return calibrate(
        height_lab.profile,
        height_lab.press,
        height_lab.undeformed,
        target=height_lab.tmd,
        rows=HALF,
    )


def slope_error_deg(lab: HeightLab, result: Calibrated) -> float:
    """Mean error of the lower half's slopes, in degrees."""
    pipeline = Pipeline(lab.profile, result.bundle)
    (frame,) = read_frames(pipeline.profile, lab.press)
    found = pipeline.process(frame)[Gradients]
    gy, gx = np.gradient(lab.height_mm, MM_PER_PX)
    off = np.hypot(found.x - gx, found.y - gy)[HALF.stop + 4 : -4, 4:-4]
    return float(np.degrees(np.arctan(off)).mean())


def test_slopes_come_back_on_rows_that_were_not_given(
    height_lab: HeightLab, fitted: Calibrated
) -> None:
    assert slope_error_deg(height_lab, fitted) < 1.0


def test_without_a_reference_the_light_of_the_press_is_used(height_lab: HeightLab) -> None:
    for reference in (None, height_lab.press):
        result = calibrate(
            height_lab.profile,
            height_lab.press,
            reference,
            target=height_lab.tmd,
            rows=HALF,
            scored=False,
        )
        assert slope_error_deg(height_lab, result) < 1.5
        assert any("stands in" in note for note in result.notes)
        stand_in = result.bundle.reference.pixels
        undeformed = cv2.imread(str(height_lab.undeformed / "led0.png"), cv2.IMREAD_UNCHANGED)
        assert np.abs(stand_in[..., 0] / undeformed - 1).mean() < 0.03


def test_a_given_reference_is_used(fitted: Calibrated) -> None:
    assert not any("stands in" in note for note in fitted.notes)


def test_the_direction_of_each_light_is_learned(fitted: Calibrated) -> None:
    learned = np.array(fitted.bundle.manifest.channel_azimuth_deg)
    off = (learned - np.array(AZIMUTHS_DEG) + 180) % 360 - 180
    assert np.abs(off).max() < 10


def test_the_score_is_that_of_held_out_rows(fitted: Calibrated) -> None:
    summary = fitted.summary(Path("b"))
    held_out = summary["held_out"]
    assert held_out["presses"] == len(summary["presses"])
    assert held_out["normal_error_deg"]["mean"] < 0.3 * held_out["predict_flat_deg"]
    assert held_out["height_rmse_mm"] < 0.01
    assert summary["coverage"]["image_fraction"] == 0.5
    assert fitted.bundle.manifest.ball_diameters_mm == ()


def test_the_bundle_and_its_report_are_complete(fitted: Calibrated, tmp_path: Path) -> None:
    fitted.save(tmp_path / "bundle")
    assert Bundle.load(tmp_path / "bundle").manifest.channels == fitted.bundle.manifest.channels
    report = (tmp_path / "bundle" / "report.html").read_text()
    assert f"rows 0:{HALF.stop} of map.tmd" in report


def test_balls_need_a_reference(height_lab: HeightLab) -> None:
    with pytest.raises(InputError, match="--reference"):
        calibrate(height_lab.profile, height_lab.press, ball_diameter_mm=4)


def test_one_map_describes_one_observation(height_lab: HeightLab, tmp_path: Path) -> None:
    for name in ("a", "b"):
        shutil.copytree(height_lab.press, tmp_path / "two" / name)
    with pytest.raises(InputError, match="one observation"):
        calibrate(height_lab.profile, tmp_path / "two", target=height_lab.tmd)


def test_rows_without_a_height_map_are_refused_in_a_sentence(height_lab: HeightLab) -> None:
    message = refused(
        *("calibrate", height_lab.profile, "--presses", height_lab.press),
        *("--reference", height_lab.undeformed, "--ball-diameter-mm", 4, "--rows", "0:60"),
        *("--out", height_lab.folder / "never"),
    )
    assert ".tmd" in message
    assert not (height_lab.folder / "never").exists()


def test_rows_beyond_the_map_are_refused_in_a_sentence(height_lab: HeightLab) -> None:
    message = refused(
        *("calibrate", height_lab.profile, "--presses", height_lab.press),
        *("--target", height_lab.tmd, "--rows", "0:999", "--out", height_lab.folder / "never"),
    )
    assert f"rows 0:{HEIGHT}" in message


def without_plane(height: Array) -> Array:
    y, x = np.mgrid[: height.shape[0], : height.shape[1]]
    plane = np.stack([np.ones(height.size), x.ravel(), y.ravel()], axis=1)
    fit = plane @ np.linalg.lstsq(plane, height.ravel(), rcond=None)[0]
    return np.asarray(height - fit.reshape(height.shape))


@pytest.mark.headline
def test_half_of_a_real_map_gives_the_relief_of_the_other_half(
    recordings: Path, tmp_path: Path
) -> None:
    scan = recordings / "six_led" / "groove"
    done = tactile(
        *("calibrate", GROOVE, "--presses", scan, "--reference", scan),
        *("--target", scan / "heightmap.tmd", "--rows", "0:257", "--out", tmp_path / "b", "--json"),
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["held_out"]["normal_error_deg"]["mean"] < 1.0
    done = tactile(
        *("run", GROOVE, "--bundle", tmp_path / "b", "--input", scan),
        *("--out", tmp_path / "o", "--save", "npz,tmd"),
    )
    assert done.returncode == 0, done.stderr

    makers = read_tmd(scan / "heightmap.tmd").height_mm.astype(np.float64)[257:]
    with np.load(tmp_path / "o" / "groove.npz") as data:
        whole = data["height_mm"]
    ours = whole.astype(np.float64)[257:]
    maps = [without_plane(height).ravel() for height in (ours, makers)]
    assert np.corrcoef(*maps)[0, 1] > 0.985

    again = read_tmd(tmp_path / "o" / "groove.tmd")
    np.testing.assert_array_equal(again.height_mm, whole)
    assert again.mm_per_px == pytest.approx(0.0274581, rel=1e-4)
