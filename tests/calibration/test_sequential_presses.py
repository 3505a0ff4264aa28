"""Presses of a ball under six sequential lights."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from support.height_lab import (
    AZIMUTHS_DEG,
    HEIGHT,
    MM_PER_PX,
    WIDTH,
    HeightLab,
    lit,
    make_height_lab,
)

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.fitting import calibrate

BALL_MM = 3.0
CENTRES_PX = [(40.0, 35.0), (118.5, 40.0), (80.0, 62.5), (45.0, 84.0), (121.0, 80.5), (80.0, 30.0)]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> HeightLab:
    """Six lights, and a folder with one folder per press."""
    lab = make_height_lab(tmp_path_factory.mktemp("rig"))
    for number, centre in enumerate(CENTRES_PX):
        height = BallPress(centre, BALL_MM, 0.7).height_mm((HEIGHT, WIDTH), MM_PER_PX)
        record(lab.folder / "presses" / f"press{number}", height, number)
    return lab


def record(folder: Path, height_mm: np.ndarray, seed: int) -> None:
    folder.mkdir(parents=True)
    for k, exposure in enumerate(lit(height_mm, seed)):
        cv2.imwrite(str(folder / f"led{k}.png"), exposure)


def test_circles_are_found_and_the_lights_learned(rig: HeightLab) -> None:
    made = calibrate(rig.profile, rig.folder / "presses", rig.undeformed, ball_diameter_mm=BALL_MM)
    assert [press.file for press in made.presses] == [f"press{n}" for n in range(len(CENTRES_PX))]
    assert all(press.used for press in made.presses)
    found = np.array([press.centre_px for press in made.presses])
    assert np.abs(found - CENTRES_PX).max() < 0.5
    off = np.array(made.bundle.manifest.channel_azimuth_deg) - AZIMUTHS_DEG
    assert np.abs((off + 180) % 360 - 180).max() < 5
    assert made.notes == ()
    assert made.score is not None
    assert made.score.mean_deg < 3
