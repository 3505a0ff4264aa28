"""The plane of the undeformed surface is found under drift, noise and large contacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactile_core.algorithms.heights.levelling import RestPlane, fit_rest_plane

Array = NDArray[Any]

MM_PER_PX = 0.1
SHAPE = (120, 160)
Y_MM, X_MM = (
    MM_PER_PX * (axis - (size - 1) / 2)
    for axis, size in zip(np.mgrid[: SHAPE[0], : SHAPE[1]], SHAPE, strict=True)
)


def found(height_mm: Array, noise_mm: Array | float = 0, drift_slope: float = 0.05) -> RestPlane:
    gy, gx = np.gradient(height_mm, MM_PER_PX)
    cell_mm = MM_PER_PX, MM_PER_PX
    return fit_rest_plane(height_mm + noise_mm, gx, gy, cell_mm=cell_mm, drift_slope=drift_slope)


def above(plane: RestPlane, height_mm: Array) -> Array:
    return np.asarray(height_mm - plane.heights_mm(SHAPE, (MM_PER_PX, MM_PER_PX)))


def punch(share: float) -> Array:
    """Height map of a flat punch, 0.5 mm deep, on the left ``share`` of the image."""
    edge_mm = X_MM[0, 0] + share * SHAPE[1] * MM_PER_PX
    return np.asarray(0.5 * np.exp(-np.maximum(X_MM - edge_mm, 0) / 0.3))


def ball(depth_mm: float, radius_mm: float = 3.0) -> Array:
    r2 = X_MM**2 + Y_MM**2
    sphere = np.sqrt(np.maximum(radius_mm**2 - r2, 0)) - radius_mm
    return np.asarray(np.maximum(sphere + depth_mm, 0))


@settings(max_examples=40, deadline=None)
@given(
    st.floats(-2, 2),
    st.floats(-0.03, 0.03),
    st.floats(-0.03, 0.03),
    st.floats(0, 0.4),
)
def test_level_and_drift_are_found_next_to_a_punch_on_two_fifths_of_the_image(
    level_mm: float, slope_x: float, slope_y: float, share: float
) -> None:
    drift = level_mm + slope_x * X_MM + slope_y * Y_MM
    rng = np.random.default_rng(0)
    height = punch(share) + drift + rng.normal(0, 5e-4, SHAPE)
    plane = found(height)
    rest = above(plane, height)[punch(share) < 1e-3]
    assert np.sqrt(np.mean(rest**2)) < 0.02 * 0.5


@pytest.mark.parametrize("share", [0.45, 0.5, 0.6])
def test_the_lower_of_two_levels_is_the_gel_even_below_a_larger_object(share: float) -> None:
    noise = np.random.default_rng(0).normal(0, 0.003, SHAPE)
    assert found(punch(share), noise).level_mm == pytest.approx(0, abs=0.02)


def test_gel_piled_up_in_front_of_a_sheared_object_hides_no_level() -> None:
    heap = -0.6 * np.exp(-np.square((X_MM - 2) / 0.7) - np.square(Y_MM / 2.5))
    noise = np.random.default_rng(0).normal(0, 0.003, SHAPE)
    height_mm = punch(0.5) * 0.6 + heap
    assert found(height_mm, noise).level_mm == pytest.approx(0, abs=0.03)


def test_the_bulge_next_to_a_ball_is_no_lower_level() -> None:
    r_mm = np.hypot(X_MM, Y_MM)
    bulge = np.where((r_mm > 3) & (r_mm < 5), -0.08, 0.0)
    assert found(ball(0.4) + bulge).level_mm == pytest.approx(0, abs=0.03)


def test_an_undeformed_gel_is_at_zero() -> None:
    height = np.random.default_rng(0).normal(0.7, 1e-3, SHAPE)
    assert found(height).level_mm == pytest.approx(0.7, abs=1e-3)


def test_a_ball_is_measured_from_the_rest_surface() -> None:
    plane = found(ball(0.8) - 0.3)
    assert above(plane, ball(0.8) - 0.3).max() == pytest.approx(ball(0.8).max(), abs=2e-3)


def test_a_shape_that_fills_the_image_keeps_its_slopes() -> None:
    height = np.sqrt(30.0**2 - (X_MM + 8) ** 2 - (Y_MM + 6) ** 2)
    plane = found(height)
    assert (plane.slope_x, plane.slope_y) == (0, 0)


def test_a_tilt_too_steep_for_drift_stays() -> None:
    assert found(0.2 * X_MM).slope_x == 0


def test_without_drift_only_the_level_is_found() -> None:
    plane = found(0.02 * X_MM + 0.4, drift_slope=0)
    assert (plane.slope_x, plane.slope_y) == (0, 0)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (2, 2)])
def test_tiny_images_have_a_level(shape: tuple[int, int]) -> None:
    flat = np.full(shape, 0.4, np.float32)
    plane = fit_rest_plane(flat, 0 * flat, 0 * flat, cell_mm=(1, 1), drift_slope=0.05)
    assert plane.heights_mm(shape, (1, 1)) == pytest.approx(flat, abs=1e-6)
