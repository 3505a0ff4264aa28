"""One press of a ball gives millimetres, on the real sensor and on virtual ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from support.ball_calibration import radius_ratio, used, virtually_calibrated
from support.command_line import tactile

from tactile_9dtact.depth_table import DepthTableImporter
from tactile_core.calibration.fitting import calibrate, calibrate_presses
from tactile_core.errors import CalibrationError
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, HeightMap, Reference
from tactile_sim import VirtualStage

PROFILE = load_profile("9dtact")
BALL_MM = 8.0


class Unit:
    """A virtual unit and its undeformed image."""

    def __init__(self, seed: int, optics: dict[str, Any] | None = None) -> None:
        self.stage = VirtualStage("9dtact", seed=seed, overrides={"optics": optics or {}})
        undeformed = self.stage.frame()
        self.reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)

    def press(self, kind: str, x_mm: float, y_mm: float, depth_mm: float, **sizes: Any) -> Frame:
        self.stage.reset()
        self.stage.indenter(kind, x_mm=x_mm, y_mm=y_mm, **sizes)
        self.stage.press(depth_mm=depth_mm)
        return self.stage.frame()

    def calibrated(self, **presses: Frame) -> Pipeline:
        made = calibrate_presses(
            self.stage.profile, presses, self.reference, ball_diameter_mm=BALL_MM, scored=False
        )
        return Pipeline(self.stage.profile, made.bundle, self.reference)


@pytest.mark.parametrize("optics", [{}, {"coat": {"absorption_per_mm": 1.0}}])
@pytest.mark.parametrize("seed", [0, 1])
def test_one_press_measures_other_balls_within_a_fortieth_of_a_millimetre(
    seed: int, optics: dict[str, Any]
) -> None:
    unit = Unit(seed, optics)
    one = unit.press("sphere", 1.0, -0.5, 1.2, diameter_mm=BALL_MM)
    pipeline = unit.calibrated(one=one)
    for diameter_mm, x_mm, y_mm, depth_mm in (
        (8.0, -2.0, 1.5, 1.2),
        (5.0, 3.0, -2.0, 0.8),
        (12.0, -4.0, -1.0, 0.7),
    ):
        frame = unit.press("sphere", x_mm, y_mm, depth_mm, diameter_mm=diameter_mm)
        error = pipeline.process(frame)[HeightMap].mm - unit.stage.truth().height_mm
        assert np.sqrt(np.mean(error[unit.stage.truth().contact] ** 2)) < 0.025


def test_the_commands_calibrate_and_score_the_virtual_sensor(tmp_path: Path) -> None:
    report = virtually_calibrated("9dtact", tmp_path)
    assert used(report) == 12
    assert radius_ratio(report) == pytest.approx(1, abs=0.05)
    assert report["held_out"]["height_rmse_mm"] < 0.02


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("flat", {"size_mm": (14.0, 2.0)}),
        ("flat", {"diameter_mm": 5.0}),
        ("cylinder", {"diameter_mm": 8.0, "length_mm": 20.0}),
    ],
)
def test_a_press_of_something_else_is_one_sentence(kind: str, sizes: dict[str, Any]) -> None:
    unit = Unit(0)
    press = unit.press(kind, 0.0, 0.0, 0.6, **sizes)
    with pytest.raises(CalibrationError, match=r"not darken like a ball|not (a|one) ball"):
        unit.calibrated(press=press)


@pytest.fixture(scope="module")
def pictures(recordings: Path) -> Path:
    """Return the folder with the real press, of a ball of 4.0 mm radius."""
    folder = recordings / "ninedtact" / "sensor_1" / "depth_calibration"
    if not folder.exists():
        pytest.skip(f"{folder} is missing; it is a sensor's folder of 9DTact")
    return folder


def measured(pictures: Path, images: str) -> NDArray[np.float32]:
    """Return the heights in the only press by a calibration on it."""
    press, undeformed = (pictures / f"{images}{name}.png" for name in ("sample", "ref"))
    made = calibrate("9dtact", press, undeformed, ball_diameter_mm=BALL_MM, scored=False)
    (frame,) = read_frames(PROFILE, press)
    return Pipeline(PROFILE, made.bundle).process(frame)[HeightMap].mm


def around_press(height: NDArray[np.float32]) -> tuple[NDArray[np.float64], ...]:
    """Return x, y and height in mm of the pixels within 3 mm of the middle of the press."""
    y, x = (axis * PROFILE.image.mm_per_px for axis in np.indices(height.shape))
    pressed = height > 0.5 * height.max()
    near = np.hypot(x - x[pressed].mean(), y - y[pressed].mean()) < 3.0
    return x[near], y[near], height[near].astype(np.float64)


@pytest.mark.parametrize("images", ["rectify_crop_", ""], ids=["rectified", "of the camera"])
def test_the_real_ball_has_its_radius(pictures: Path, images: str) -> None:
    x, y, z = around_press(measured(pictures, images))

    def off(ball: NDArray[np.float64]) -> NDArray[np.float64]:
        square = (BALL_MM / 2) ** 2 - (x - ball[0]) ** 2 - (y - ball[1]) ** 2
        return np.asarray(np.sqrt(square) - BALL_MM / 2 + ball[2] - z)

    found = least_squares(off, [x.mean(), y.mean(), 1.9])
    assert np.sqrt(np.mean(found.fun**2)) < 0.03
    assert found.x[2] == pytest.approx(1.85, abs=0.1)


@pytest.mark.parametrize("images", ["rectify_crop_", ""], ids=["rectified", "of the camera"])
def test_depths_are_those_of_the_authors_within_a_twentieth_of_a_millimetre(
    pictures: Path, images: str
) -> None:
    frame, undeformed = (
        next(iter(read_frames(PROFILE, pictures / f"rectify_crop_{name}.png")))
        for name in ("sample", "ref")
    )
    reference = Reference(undeformed.pixels.astype(np.float32), undeformed.channels)
    theirs = DepthTableImporter().read(pictures.parent, PROFILE).measure(frame, reference).mm
    x, y, z = around_press(theirs)
    row, column = (np.rint(axis / PROFILE.image.mm_per_px).astype(int) for axis in (y, x))
    ours = measured(pictures, images)[row, column]
    assert np.sqrt(np.mean((ours - z) ** 2)) < 0.05


def test_four_commands_lead_from_images_to_millimetres(pictures: Path, tmp_path: Path) -> None:
    press, undeformed = (pictures / f"{name}.png" for name in ("sample", "ref"))
    bundle = tmp_path / "bundle"
    done = tactile(
        *("calibrate", "9dtact", "--presses", press, "--reference", undeformed),
        *("--ball-diameter-mm", BALL_MM, "--out", bundle),
    )
    assert done.returncode == 0, done.stderr
    done = tactile("run", "9dtact", "--bundle", bundle, "--input", press, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["max_height_mm"] == pytest.approx(1.85, abs=0.1)


def test_exchanged_images_are_one_sentence(pictures: Path, tmp_path: Path) -> None:
    press, undeformed = (pictures / f"rectify_crop_{name}.png" for name in ("ref", "sample"))
    done = tactile(
        *("calibrate", "9dtact", "--presses", press, "--reference", undeformed),
        *("--ball-diameter-mm", BALL_MM, "--out", tmp_path / "bundle"),
    )
    assert done.returncode == 2
    assert "exchange --presses and --reference" in done.stderr
    assert not (tmp_path / "bundle").exists()


def test_a_sensor_with_coloured_lights_is_one_sentence(recordings: Path, tmp_path: Path) -> None:
    folder = recordings / "gelsight_mini" / "ball_presses"
    done = tactile(
        *("calibrate", "9dtact", "--presses", folder, "--reference", folder / "background.png"),
        *("--ball-diameter-mm", 6.31, "--out", tmp_path / "bundle"),
    )
    assert done.returncode == 2
    assert "its light is not white" in done.stderr
