"""A square pattern is measured along x and along y, whatever it consists of."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from experiments.measured_scale import PATTERNS, SEEDS, grid, grid_errors, marked_gels
from tactile_core.algorithms.markers.grid_pitch import measure_pitch
from tactile_core.formats.images import read_image


@pytest.mark.parametrize("seeds", [[0], pytest.param(SEEDS, marks=pytest.mark.headline)])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_error_on_photographs_of_grids_is_as_published(
    pattern: str, seeds: Sequence[int]
) -> None:
    errors = np.array(list(grid_errors(pattern, seeds)))
    assert np.median(errors) <= 0.005
    assert errors.max() <= 0.015


@pytest.mark.parametrize("pattern", PATTERNS)
def test_pixels_that_are_not_square_are_measured_along_both_axes(pattern: str) -> None:
    found = measure_pitch(grid(pattern, 18.0, 7.0, 0.0, 1, aspect=1.06))
    assert found is not None
    assert (found.x_px, found.y_px) == pytest.approx((18, 18 / 1.06), rel=0.006)


def test_perspective_is_reported() -> None:
    flat, tilted = (measure_pitch(grid("lines", 15.0, 3.0, taper, 0)) for taper in (0.0, 0.1))
    assert flat is not None
    assert tilted is not None
    assert flat.variation < 0.02 < 0.08 < tilted.variation


@pytest.mark.parametrize("size", [(1, 1), (8, 8), (12, 300), (120, 160)])
def test_an_image_of_one_colour_has_no_pattern(size: tuple[int, int]) -> None:
    assert measure_pitch(np.zeros(size, np.uint8)) is None
    assert measure_pitch(np.full((*size, 3), 200, np.uint8)) is None


def test_an_uneven_image_and_stripes_have_no_square_pattern() -> None:
    noise = np.random.default_rng(0).normal(120, 5, (120, 160))
    assert measure_pitch(noise) is None
    assert measure_pitch(noise[:12]) is None
    assert measure_pitch(noise + 60 * np.sin(np.arange(160) / 2)) is None


def test_the_pitch_of_real_markers_is_near_the_published_scale(recordings: Path) -> None:
    for name, image, pitch_mm, mm_per_px in marked_gels(recordings):
        found = measure_pitch(image)
        assert found is not None, name
        mean_mm = (pitch_mm / found.x_px + pitch_mm / found.y_px) / 2
        assert mean_mm == pytest.approx(mm_per_px, rel=0.04), name


@pytest.mark.parametrize(
    "gel",
    ["three_colour/objectfolder/reference.png", "gelsight_mini/ball_presses/background.png"],
)
def test_a_gel_without_markers_has_no_pitch(recordings: Path, gel: str) -> None:
    assert measure_pitch(read_image(recordings / gel)) is None
