"""A folder that gs_sdk has collected and labelled is calibrated as it is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.command_line import tactile
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress

CENTRES_PX = [(60.0, 45.0), (100.0, 70.0), (80.0, 60.0), (110.0, 40.0), (55.0, 75.0), (95.0, 55.0)]
DEPTH_MM = 0.8


@pytest.fixture
def collected(lab: VirtualLab, tmp_path: Path) -> Path:
    """Return a folder with presses, their circles, what gs_sdk draws, and the background."""
    folder = tmp_path / "calibration"
    lab.save(folder / "background.png", None)
    radius_px = np.sqrt(DEPTH_MM * (BALL_MM - DEPTH_MM)) / lab.profile.image.mm_per_px
    lines = ["experiment_reldir,diameter(mm)"]
    for number, centre in enumerate(CENTRES_PX):
        place = f"{BALL_MM:.3f}mm/{number}"
        press = BallPress(centre, BALL_MM, DEPTH_MM)
        lab.save(folder / place / "gelsight.png", press, seed=number)
        lab.save(folder / place / "labeled.png", press, seed=number)
        np.savez(folder / place / "label.npz", center=list(centre), radius=round(radius_px))
        lines.append(f"{place},{BALL_MM:.3f}")
    (folder / "catalog.csv").write_text("\n".join(lines) + "\n")
    return folder


def test_its_circles_are_taken_and_its_spheres_are_of_the_ball(
    lab: VirtualLab, collected: Path, tmp_path: Path
) -> None:
    done = tactile(
        *("calibrate", lab.profile_path, "--presses", collected, "--labels", collected),
        *("--reference", collected / "background.png", "--model", "core.polynomial"),
        *("--out", tmp_path / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert [press["centre_px"] for press in report["presses"]] == [list(c) for c in CENTRES_PX]
    assert all(press["used"] for press in report["presses"])
    assert report["held_out"]["sphere_radius_ratio"]["median"] == pytest.approx(1, abs=0.05)


def test_a_press_without_a_circle_is_left_out(
    lab: VirtualLab, collected: Path, tmp_path: Path
) -> None:
    (collected / f"{BALL_MM:.3f}mm/2/label.npz").unlink()
    done = tactile(
        *("calibrate", lab.profile_path, "--presses", collected, "--labels", collected),
        *("--reference", collected / "background.png", "--model", "core.polynomial"),
        *("--out", tmp_path / "bundle", "--json"),
    )
    assert done.returncode == 0, done.stderr
    used = [press["used"] for press in json.loads(done.stdout)["presses"]]
    assert used == [True, True, False, True, True, True]


def test_a_circle_outside_the_image_is_one_sentence(
    lab: VirtualLab, collected: Path, tmp_path: Path
) -> None:
    label = collected / f"{BALL_MM:.3f}mm/1/label.npz"
    np.savez(label, center=[400, 50], radius=9)
    done = tactile(
        *("calibrate", lab.profile_path, "--presses", collected, "--labels", collected),
        *("--reference", collected / "background.png", "--out", tmp_path / "bundle"),
    )
    assert done.returncode == 2
    assert f"{label}: the circle's centre (400, 50) is outside the image" in done.stderr
    assert not (tmp_path / "bundle").exists()
