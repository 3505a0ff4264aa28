"""Standard deviations of slopes and of the heights that are integrated from them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.poisson import integrate
from tactile_core.algorithms.poisson.integration import height_std
from tactile_core.algorithms.slopes.slope_field import ERRORS, error_table, slope_std


@given(st.floats(0.02, 0.3), st.integers(0, 100))
def test_the_table_holds_the_standard_deviation_of_normal_errors(share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    true = rng.uniform(0.01, 0.5, 20_000)
    errors = rng.normal(0, share, (20_000, 2)) * true[:, None]
    slopes, std = error_table(true, errors)
    assert (np.diff(slopes) > 0).all()
    np.testing.assert_allclose(std, share * slopes, rtol=0.25)


def test_a_model_that_ignores_small_slopes_is_not_free_of_errors() -> None:
    slopes = np.concatenate([np.zeros(500), np.linspace(0.02, 0.3, 500)])
    errors = np.zeros((1000, 2))
    _, std = error_table(slopes, errors)
    assert std[0] == pytest.approx(0.02, rel=0.3)


def test_a_few_pixels_make_a_table_of_one_row() -> None:
    slopes, std = error_table(np.array([0.1, 0.2]), np.full((2, 2), 0.01))
    assert slopes.tolist() == pytest.approx([0.15])
    assert std.tolist() == pytest.approx([0.01])


def test_an_edge_is_less_certain_than_a_plane() -> None:
    gx = np.zeros((60, 80), np.float32)
    gx[:, 40:] = 0.4
    table = np.array([0.0, 1.0], np.float32), np.array([0.01, 0.01], np.float32)
    std = slope_std(gx, np.zeros_like(gx), *table)
    assert std.shape == gx.shape
    assert std[30, 10] == pytest.approx(0.01)
    # an error of position of a pixel is an error of slope of half the step on each side
    assert std[30, 39:41].tolist() == pytest.approx([0.4 * ERRORS.edge_px / 2] * 2, rel=0.01)


def test_cells_bound_the_size_of_the_result() -> None:
    flat = np.zeros((480, 640), np.float32)
    table = np.array([0.0], np.float32), np.array([0.02], np.float32)
    std = slope_std(flat, flat, *table)
    assert std.shape == (120, 160)
    np.testing.assert_allclose(std, 0.02, rtol=1e-6)


def test_propagated_errors_are_those_of_integrated_noise() -> None:
    # slopes with errors in one disc: the height is uncertain there, and less so far from it
    rows, columns, scale_mm, length_px = 64, 80, 0.1, 4
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    std: Float32 = np.where(np.hypot(x - 40, y - 32) < 12, 0.05, 0.0).astype(np.float32)
    rng = np.random.default_rng(5)
    heights = []
    for _ in range(200):
        gx, gy = (
            np.kron(rng.normal(size=(rows // length_px, columns // length_px)), np.ones((4, 4)))
            for _ in range(2)
        )
        height = integrate(*((g * std).astype(np.float32) for g in (gx, gy)), mm_per_px=scale_mm)
        heights.append(height - np.median(height))
    observed = np.std(heights, axis=0)
    predicted = height_std(std, (scale_mm, scale_mm), length_px * scale_mm)
    near, far = np.hypot(x - 40, y - 32) < 8, np.hypot(x - 40, y - 32) > 25
    # the sides of the image reflect errors, which the prediction leaves out
    assert np.median(predicted[near] / observed[near]) == pytest.approx(1, abs=0.35)
    assert np.median(predicted[near]) > 2 * np.median(predicted[far])


@given(st.floats(0.1, 10))
def test_propagation_is_linear(factor: float) -> None:
    std = np.full((12, 16), 0.01, np.float32)
    once, times = (height_std(np.float32(f) * std, (0.2, 0.2), 1.0) for f in (1, factor))
    np.testing.assert_allclose(times, factor * once, rtol=1e-3)
