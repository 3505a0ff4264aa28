"""Slopes beyond the calibrated ones, on analytic Lambertian surfaces that turn away from lights."""

import numpy as np
import pytest

from tactile_desktop_six_led.lit_lights import fit_lit_lights

AZIMUTHS = np.radians(np.arange(0, 360, 60))
ELEVATION = np.radians(25)
TOWARD = np.c_[
    np.cos(ELEVATION) * np.cos(AZIMUTHS),
    np.cos(ELEVATION) * np.sin(AZIMUTHS),
    np.full(6, np.sin(ELEVATION)),
]
AMBIENT = 0.25


def responses(normal_xy):
    """(6, N) relative change of each light on a matte surface with ambient light."""
    facing = np.sqrt(1 - (normal_xy**2).sum(axis=1))
    lit = np.maximum(TOWARD @ np.c_[normal_xy, facing].T, 0) / np.sin(ELEVATION)
    return ((1 - AMBIENT) * (lit - 1)).astype(np.float32)


def disc(radius, count, rng):
    """(count, 2) normals whose sine is up to this one."""
    angle = rng.uniform(0, 2 * np.pi, count)
    length = radius * np.sqrt(rng.uniform(0, 1, count))
    return np.c_[length * np.cos(angle), length * np.sin(angle)].astype(np.float32)


@pytest.fixture
def calibrated():
    """Calibrated up to 35°; the other model is right except near the steepest slopes."""
    rng = np.random.default_rng(5)
    normal_xy = disc(np.sin(np.radians(35)), 5000, rng)
    position = rng.uniform(-0.5, 0.5, (5000, 2)).astype(np.float32)
    length = np.linalg.norm(normal_xy, axis=1, keepdims=True)
    levels_off = normal_xy * np.minimum(1, 0.45 / np.maximum(length, 1e-6))
    return fit_lit_lights(responses(normal_xy), position, normal_xy, levels_off)


def along(angle_deg, azimuth_deg=20.0):
    """One pixel of a surface at this angle."""
    azimuth = np.radians(azimuth_deg)
    sine = np.sin(np.radians(angle_deg))
    return np.array([[np.cos(azimuth), np.sin(azimuth)]], np.float32) * np.float32(sine)


MIDDLE = np.zeros((1, 2), np.float32)


@pytest.mark.parametrize("azimuth_deg", range(0, 360, 30))
@pytest.mark.parametrize(("angle_deg", "within_deg"), [(30, 1), (45, 1), (60, 3)])
def test_walls_up_to_60_degrees_follow_from_slopes_up_to_35(
    calibrated, angle_deg, within_deg, azimuth_deg
):
    true = along(angle_deg, azimuth_deg)
    wrong = np.zeros((2, 1), np.float32)
    found = calibrated.beyond(wrong, responses(true), MIDDLE)
    angle = np.degrees(np.arcsin(np.linalg.norm(found)))
    assert angle == pytest.approx(angle_deg, abs=within_deg)


def test_the_other_model_stays_where_it_was_calibrated(calibrated):
    fitted = np.array([[0.21], [0.07]], np.float32)
    found = calibrated.beyond(fitted, responses(along(10)), MIDDLE)
    np.testing.assert_array_equal(found, fitted)


@pytest.mark.parametrize("shaded", [[0], [2, 3]])
def test_level_gel_in_a_cast_shadow_is_level(calibrated, shaded):
    response = responses(along(0))
    response[shaded] = calibrated.floors[shaded, None]
    found = calibrated.beyond(np.full((2, 1), 0.3, np.float32), response, MIDDLE)
    assert np.abs(found).max() < 0.01


def test_at_least_three_lights_are_used(calibrated):
    dark = np.full((6, 4), -0.9, np.float32)
    assert calibrated.find_lit(dark).sum(axis=0).tolist() == [3, 3, 3, 3]


@pytest.mark.parametrize("lights", [3, 4, 5])
def test_fewer_lights_leave_fewer_out(lights):
    rng = np.random.default_rng(0)
    normal_xy = disc(0.3, 800, rng)
    response = responses(normal_xy)[:lights]
    model = fit_lit_lights(response, np.zeros((800, 2), np.float32), normal_xy, normal_xy)
    assert model.find_lit(np.full((lights, 1), -0.9, np.float32)).sum() == 3


def test_a_light_that_is_always_dark_does_not_break_the_fit():
    rng = np.random.default_rng(0)
    normal_xy = disc(0.3, 800, rng)
    response = responses(normal_xy)
    response[0] = -1.0
    model = fit_lit_lights(response, np.zeros((800, 2), np.float32), normal_xy, normal_xy)
    assert np.isfinite(model.rows).all()
