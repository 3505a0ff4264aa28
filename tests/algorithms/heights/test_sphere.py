"""The sphere that a height map shows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.heights.sphere import BallPress, fit_sphere, rest_height

SHAPE, SCALE = (90, 120), 0.1
ROWS, COLUMNS = np.mgrid[: SHAPE[0], : SHAPE[1]]


def height_px(centre_px: tuple[float, float], diameter_mm: float, depth_mm: float) -> np.ndarray:
    height_mm = BallPress(centre_px, diameter_mm, depth_mm).height_mm(SHAPE, SCALE)
    return (height_mm / SCALE).astype(np.float32)


@given(
    x=st.floats(45, 75), y=st.floats(40, 50), diameter_mm=st.floats(3, 8), depth=st.floats(0.1, 0.2)
)
def test_the_sphere_is_the_ball_that_was_pressed(
    x: float, y: float, diameter_mm: float, depth: float
) -> None:
    height = height_px((x, y), diameter_mm, depth * diameter_mm)
    sphere = fit_sphere(height, np.hypot(COLUMNS - x, ROWS - y) < 40)
    assert sphere is not None
    assert sphere.radius_px * SCALE == pytest.approx(diameter_mm / 2, rel=0.01)
    np.testing.assert_allclose(sphere.centre_px, (x, y), atol=0.02)


def test_an_area_that_is_off_changes_nothing() -> None:
    height = height_px((60, 45), 4, 0.6)
    spheres = [fit_sphere(height, np.hypot(COLUMNS - x, ROWS - 45) < 30) for x in (55, 60, 66)]
    radii = [sphere.radius_px for sphere in spheres if sphere is not None]
    np.testing.assert_allclose(radii, 20, rtol=1e-3)


def test_heights_that_are_too_small_by_a_share_show_a_larger_sphere() -> None:
    sphere = fit_sphere(0.8 * height_px((60, 45), 6, 0.4), np.ones(SHAPE, bool))
    assert sphere is not None
    assert sphere.radius_px == pytest.approx(30 / 0.8, rel=0.03)


def test_a_hollow_has_a_negative_radius() -> None:
    square = (COLUMNS - 60.0) ** 2 + (ROWS - 45.0) ** 2
    bowl = (square / 60).astype(np.float32)
    sphere = fit_sphere(bowl, square < 20**2)
    assert sphere is not None
    assert sphere.radius_px < 0


def test_on_a_dome_the_undeformed_surface_is_removed() -> None:
    square = (COLUMNS - 59.5) ** 2 + (ROWS - 44.5) ** 2
    rest = rest_height(SHAPE, mm_per_px=1, radius_mm=200)
    ball = np.sqrt(np.maximum(20.0**2 - square, 0)) - 13
    height = np.maximum(ball + rest, 0).astype(np.float32)
    domed = fit_sphere(height, square < 30**2, rest_px=rest)
    flat = fit_sphere(height, square < 30**2)
    assert domed is not None
    assert flat is not None
    assert domed.radius_px == pytest.approx(20, rel=1e-3)
    assert flat.radius_px == pytest.approx(1 / (1 / 20 + 1 / 200), rel=0.02)


def test_too_few_pixels_show_no_sphere() -> None:
    assert fit_sphere(np.zeros(SHAPE, np.float32), np.zeros(SHAPE, bool)) is None
    assert fit_sphere(height_px((60, 45), 0.5, 0.1), np.hypot(COLUMNS - 60, ROWS - 45) < 3) is None
