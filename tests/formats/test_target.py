"""Grids of balls: radius, circle centres and the scale from the pitch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import InputError
from tactile_core.formats.target import BallGrid, read_target

GRID = """\
type: bga
radius: 0.25
pitch: 1
shapes:
  - {type: GridCircle, name: a, gx: 0, gy: 0, r: 7, x: 10, y: 20.5}
  - {type: GridCircle, name: b, gx: 1, gy: 0, r: 7, x: 60, y: 20.5}
  - {type: GridCircle, name: c, gx: 0, gy: 1, r: 7, x: 10, y: 70.5}
  - {type: Line, name: d, x1: 0, y1: 0, x2: 1, y2: 1}
"""


def grid_of(tmp_path: Path, text: str) -> BallGrid:
    path = tmp_path / "target.yaml"
    path.write_text(text)
    return read_target(path)


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        grid_of(tmp_path, text)
    assert "target.yaml" in str(caught.value)
    return str(caught.value)


def test_circles_are_read_and_other_shapes_ignored(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, GRID)
    assert grid.radius_mm == 0.25
    assert grid.centres_px.tolist() == [[10, 20.5], [60, 20.5], [10, 70.5]]
    assert grid.mm_per_px == pytest.approx(1 / 50)


def test_binning_halves_coordinates_relative_to_pixel_centres(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, GRID)
    half = grid.at_scale(2 / 50)
    np.testing.assert_allclose(half.centres_px, (grid.centres_px - 0.5) / 2)
    np.testing.assert_allclose(half.at_scale(1 / 50).centres_px, grid.centres_px)
    assert half.radius_mm == grid.radius_mm


def test_a_small_difference_in_scale_changes_nothing(tmp_path: Path) -> None:
    grid = grid_of(tmp_path, GRID)
    assert grid.at_scale(1.02 / 50) is grid


def test_a_scale_that_matches_no_binning_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"drawn at 0\.02 mm per pixel"):
        grid_of(tmp_path, GRID).at_scale(1.4 / 50)


def test_files_that_are_not_targets_are_rejected(tmp_path: Path) -> None:
    assert "radius" in refusal(tmp_path, GRID.replace("radius: 0.25", ""))
    assert "radius" in refusal(tmp_path, GRID.replace("radius: 0.25", "radius: 0"))
    assert "circles" in refusal(tmp_path, "radius: 0.25\n")
    assert "'y'" in refusal(tmp_path, "radius: 0.25\nshapes: [{type: GridCircle, x: 3}]\n")
    assert "number" in refusal(tmp_path, "radius: 1\nshapes: [{type: GridCircle, x: a, y: 1}]\n")


def test_a_recorded_target_is_read(recordings: Path) -> None:
    grid = read_target(recordings / "six_led/ball_grid/BGA-001/bgatarget.yaml")
    assert grid.radius_mm == 0.2465
    assert len(grid.centres_px) > 50
    assert grid.mm_per_px == pytest.approx(0.0034038, rel=0.005)
    half = grid.at_scale(0.0068076)
    np.testing.assert_allclose(half.centres_px, (grid.centres_px - 0.5) / 2)


def test_a_scan_with_drawn_circles_is_read_as_a_target(recordings: Path) -> None:
    grid = read_target(recordings / "three_colour/finger_ball_grid/scan001/scan.yaml")
    assert grid.radius_mm == 1.5875
    assert grid.centres_px.shape == (23, 2)
    assert grid.mm_per_px == pytest.approx(0.0292, rel=0.01)
    assert grid.at_scale(0.0295297735479) is grid


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius: 0.25", "radius: .inf", "radius"),
        ("radius: 0.25", "radius: 1e9", "radius"),
        ("pitch: 1", "pitch: 1e300", "pitch"),
        ("x: 60", "x: 1e300", "x must be"),
        ("x: 60", f"x: {10**400}", "x must be"),
        ("x: 60", "x: .nan", "x: should be a finite number"),
    ],
)
def test_impossible_numbers_are_rejected(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert words in refusal(tmp_path, GRID.replace(old, new))


def test_too_many_circles_are_rejected(tmp_path: Path) -> None:
    circles = ",".join(["{x: 1, y: 1}"] * 10_001)
    assert "10001 circles" in refusal(tmp_path, f"radius: 0.25\nshapes: [{circles}]\n")


@pytest.mark.parametrize("mm_per_px", [0.0, -0.02, 5e-324, 1e300, float("nan"), float("inf")])
def test_an_impossible_image_scale_is_rejected(tmp_path: Path, mm_per_px: float) -> None:
    with pytest.raises(InputError, match="drawn at"):
        grid_of(tmp_path, GRID).at_scale(mm_per_px)
