"""A height map as calibration target: its slopes, its bands and its limits."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.poisson import integrate
from tactile_core.calibration.pressed_grid import MapBlock, blocks
from tactile_core.calibration.target_surface import HeightTarget, is_height_map, parse_rows
from tactile_core.errors import InputError
from tactile_core.formats.tmd import write_tmd
from tactile_core.quantities import Frame

SHAPE = 96, 128
MM = 0.05


def frame(shape: tuple[int, int] = SHAPE, marker_mask: NDArray[np.bool_] | None = None) -> Frame:
    pixels = np.full((*shape, 6), 100, np.uint8)
    return Frame(pixels, tuple("abcdef"), MM, marker_mask=marker_mask, source="press")


def hills(shape: tuple[int, int] = SHAPE) -> NDArray[np.float64]:
    x = np.arange(shape[1]) * MM
    y = np.arange(shape[0])[:, None] * MM
    return np.asarray(0.2 * np.sin(2 * x) * np.cos(3 * y))


def written(path: Path, height_mm: NDArray[np.float64], mm_per_px: float = MM) -> Path:
    write_tmd(path / "map.tmd", height_mm.astype(np.float32), mm_per_px)
    return path / "map.tmd"


def training(target: HeightTarget) -> dict[tuple[int, int], tuple[float, float]]:
    """Slopes of all training pixels, by row and column."""
    slopes = {}
    for press in (block.training() for block in blocks(target)):
        for row, column, slope in zip(press.rows, press.columns, press.gradients, strict=True):
            slopes[int(row), int(column)] = float(slope[0]), float(slope[1])
    return slopes


def refusal(path: Path, rows: slice | None = None, blur_px: float = 2.0) -> str:
    with pytest.raises(InputError) as caught:
        blocks(HeightTarget.read(path, frame(), rows=rows, blur_px=blur_px))
    return str(caught.value)


@pytest.mark.parametrize("height_mm", [3e38, -3e38, 100.0])
def test_implausible_heights_are_refused(tmp_path: Path, height_mm: float) -> None:
    height = hills()
    height[3, 5] = height_mm
    assert "higher" in refusal(written(tmp_path, height))


@given(st.integers(0, 999), st.integers(1, 999))
def test_rows_are_half_open_and_count_from_0(first: int, count: int) -> None:
    assert parse_rows(f"{first}:{first + count}") == slice(first, first + count)


def test_either_end_of_the_rows_may_be_left_out() -> None:
    assert parse_rows(":257") == slice(0, 257)
    assert parse_rows("257:") == slice(257, None)
    assert parse_rows(" 3 : 9 ") == slice(3, 9)


@pytest.mark.parametrize("text", ["", "257", "a:b", "9:4", "4:4", "-3:9", "1:2:3", "0.5:9"])
def test_invalid_rows_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--rows"):
        parse_rows(text)


def test_a_height_map_is_recognised_by_its_name() -> None:
    assert is_height_map(Path("a/Map.TMD"))
    assert not is_height_map(Path("grid.yaml"))
    assert not is_height_map(None)


def test_its_slopes_integrate_to_the_map_up_to_a_plane(tmp_path: Path) -> None:
    target = HeightTarget.read(written(tmp_path, hills()), frame())
    (block,) = {block.target for block in blocks(target)}
    height = integrate(*block.slopes, mm_per_px=MM)
    mask = np.ones(SHAPE, bool)
    assert np.abs(blocks(target)[0].height_errors_mm(height, mask)).max() < 0.003


def test_a_groove_is_low_in_the_map_and_in_the_slopes(tmp_path: Path) -> None:
    x = np.arange(SHAPE[1])
    groove = np.broadcast_to(-0.2 * np.exp(-(((x - 60) / 8.0) ** 2)), SHAPE)
    slopes = training(HeightTarget.read(written(tmp_path, groove), frame()))
    falling = [slope[0] for (_, column), slope in slopes.items() if 50 < column < 57]
    rising = [slope[0] for (_, column), slope in slopes.items() if 63 < column < 70]
    assert max(falling) < -0.05
    assert min(rising) > 0.05


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-5, 5))
def test_slopes_do_not_depend_on_the_tilt_of_the_map(
    tmp_path_factory: pytest.TempPathFactory, a: float, b: float, c: float
) -> None:
    folder = tmp_path_factory.mktemp("plane")
    plane = c + MM * (a * np.arange(SHAPE[1]) + b * np.arange(SHAPE[0])[:, None])
    level = HeightTarget.read(written(folder, hills()), frame())
    tilted = HeightTarget.read(written(folder, hills() + plane), frame())
    for ours, theirs in zip(level.slopes, tilted.slopes, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-4)


def test_heights_outside_the_rows_have_no_influence(tmp_path: Path) -> None:
    rows = slice(20, 70)
    first = training(HeightTarget.read(written(tmp_path, hills()), frame(), rows=rows, blur_px=2))
    changed = hills()
    changed[:20], changed[70:] = 9.0, np.nan
    again = training(HeightTarget.read(written(tmp_path, changed), frame(), rows=rows, blur_px=2))
    assert first == again
    assert {row for row, _ in first} <= set(range(20, 70))


def test_borders_holes_and_markers_are_no_training_pixels(tmp_path: Path) -> None:
    height = hills()
    height[40:44, 60:64] = np.nan
    marker_mask = np.zeros(SHAPE, bool)
    marker_mask[20:24, 30:34] = True
    slopes = training(
        HeightTarget.read(written(tmp_path, height), frame(marker_mask=marker_mask), blur_px=1)
    )
    for row, column in slopes:
        assert 3 <= row < SHAPE[0] - 3
        assert 3 <= column < SHAPE[1] - 3
        assert not (37 <= row < 47 and 57 <= column < 67)
        assert not (17 <= row < 27 and 27 <= column < 37)
    assert all(np.isfinite(slope).all() for slope in slopes.values())


def test_bands_neither_overlap_nor_touch(tmp_path: Path) -> None:
    target = HeightTarget.read(written(tmp_path, hills((192, 128))), frame((192, 128)), blur_px=2)
    bands = blocks(target)
    assert len(bands) == 5
    rows = [np.flatnonzero(band.scored_area().any(axis=1)) for band in bands]
    for above, below in pairwise(rows):
        assert below[0] - above[-1] > 2 * 2


def test_steep_pixels_are_drawn_more_often_than_level_ones(tmp_path: Path) -> None:
    shape = 256, 320
    height = np.zeros(shape)
    height[:, 100:110] = -0.03 * np.arange(10)
    height[:, 110:] = -0.3
    target = HeightTarget.read(written(tmp_path, height), frame(shape))
    wall = np.abs(target.slopes[0]) > 0.3
    picked = [abs(slope[0]) > 0.3 for slope in training(target).values()]
    assert np.mean(picked) > 3 * wall.mean()


def test_slopes_are_smoothed_like_the_images(tmp_path: Path) -> None:
    x = np.arange(SHAPE[1])
    fine = np.broadcast_to(0.02 * np.sin(x * np.pi / 4), SHAPE)
    sharp, smooth = (
        HeightTarget.read(written(tmp_path, fine), frame(), blur_px=blur).smooth_slopes[0].std()
        for blur in (0.0, 2.0)
    )
    # a wave of 8 px keeps exp(−(2 · 2π / 8)² / 2) of its height under a blur of 2 px
    assert smooth / sharp == pytest.approx(0.29, abs=0.06)


def test_a_map_twice_as_fine_gives_the_same_slopes(tmp_path: Path) -> None:
    x = (np.arange(2 * SHAPE[1]) + 0.5) / 2 - 0.5
    y = (np.arange(2 * SHAPE[0])[:, None] + 0.5) / 2 - 0.5
    fine = 0.2 * np.sin(2 * x * MM) * np.cos(3 * y * MM)
    coarse = HeightTarget.read(written(tmp_path, hills()), frame())
    target = HeightTarget.read(written(tmp_path, fine, MM / 2), frame(), rows=slice(40, 120))
    assert (target.first_row, len(target.height_mm)) == (20, 40)
    np.testing.assert_allclose(target.slopes[0][1:-1], coarse.slopes[0][21:59], atol=0.01)


def test_another_size_is_refused(tmp_path: Path) -> None:
    message = refusal(written(tmp_path, hills((90, 128))))
    assert "map.tmd is 128 × 90 and the image 128 × 96" in message


def test_another_scale_is_refused(tmp_path: Path) -> None:
    assert "mm_per_px" in refusal(written(tmp_path, hills(), 1.02 * MM))


def test_rows_beyond_the_map_are_refused(tmp_path: Path) -> None:
    assert "has the rows 0:96" in refusal(written(tmp_path, hills()), slice(0, 97))
    assert "has the rows 0:96" in refusal(written(tmp_path, hills()), slice(96, None))


def test_too_few_rows_are_refused(tmp_path: Path) -> None:
    assert "more than 10 rows" in refusal(written(tmp_path, hills()), slice(50, 60))


def test_a_map_without_heights_is_refused(tmp_path: Path) -> None:
    assert "no heights" in refusal(written(tmp_path, hills() * np.nan))
    half = hills()
    half[:50] = np.nan
    assert "no heights" in refusal(written(tmp_path, half), slice(0, 50))


def test_a_band_reports_its_rows_and_its_centre(tmp_path: Path) -> None:
    band: MapBlock = blocks(HeightTarget.read(written(tmp_path, hills()), frame()))[0]
    assert band.file == "map.tmd 0:24"
    assert band.centre_px == (63.5, 11.5)
    assert band.area().sum() == pytest.approx(np.pi * band.radius_px**2)


def test_heights_are_relative_to_the_level_surface_whatever_the_maps_tilt(tmp_path: Path) -> None:
    x, y = np.arange(SHAPE[1]) * MM, np.arange(SHAPE[0])[:, None] * MM
    ridge = 0.2 * np.exp(-(((x - 3) / 0.3) ** 2)) + 0 * y
    path = written(tmp_path, 7.0 + 0.02 * x - 0.03 * y + ridge)
    target = HeightTarget.read(path, frame(), blur_px=0.0)
    for press in (block.training() for block in blocks(target)):
        assert press.heights_mm is not None
        true_mm = ridge[press.rows, press.columns]
        np.testing.assert_allclose(press.heights_mm, true_mm, atol=2e-3)
