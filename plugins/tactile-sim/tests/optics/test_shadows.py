from typing import get_args

import numpy as np
import pytest
from support.virtual_rigs import HEIGHT, QUIET, SCALE_MM, SHAPE, WIDTH, bump, level, rig

from tactile_sim.optics import RigOptics, shadows
from tactile_sim.optics.rig import Mode


def block(height_mm: float) -> np.ndarray:
    """Height map of a tower with vertical walls in the middle."""
    height = np.zeros(SHAPE, np.float32)
    height[50:70, 70:90] = height_mm
    return height


def darkened(azimuth_deg: float, height: np.ndarray, mode: Mode = "accurate") -> np.ndarray:
    """(H, W) intensity relative to the undeformed surface."""
    optics = RigOptics(
        rig((azimuth_deg,), optics={"sensor": QUIET, "lights": {"distance_mm": 200}}), mode=mode
    )
    return np.asarray(optics.expose(height)[..., 0] / optics.expose(level())[..., 0])


@pytest.mark.parametrize("mode", get_args(Mode))
@pytest.mark.parametrize("azimuth", [0, 90, 180, 270])
def test_shadows_are_on_the_side_away_from_the_light(azimuth: float, mode: Mode) -> None:
    dark = darkened(azimuth, block(0.8), mode) < 0.5
    y, x = np.nonzero(dark)
    away = np.array([np.mean(x) - (WIDTH - 1) / 2, np.mean(y) - (HEIGHT - 1) / 2])
    led_array = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
    assert away @ led_array < -0.8 * np.linalg.norm(away)


def test_the_length_of_a_shadow_follows_from_height_and_elevation() -> None:
    # The light is on the right, at 30°; the tower's left wall is at column 69.5.
    row = darkened(0, block(1.0))[60, :69]
    reach_mm = float((row[:69] < 0.5).sum()) * SCALE_MM
    assert reach_mm == pytest.approx(1.0 / np.tan(np.radians(30)), abs=0.25)


def test_a_gentle_slope_casts_no_shadow() -> None:
    hill = bump(height_mm=0.2, radius_mm=3.0)
    assert darkened(0, hill).min() > 0.5


@pytest.mark.parametrize("azimuth", [0, 130])
def test_rays_away_from_slopes_are_not_hidden(
    azimuth: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    relief = block(0.8) + bump(height_mm=0.4, radius_mm=2.0)
    near = darkened(azimuth, relief)
    monkeypatch.setattr(
        shadows, "_near_steep", lambda low, *_: tuple(slice(0, size) for size in low.shape)
    )
    np.testing.assert_array_equal(darkened(azimuth, relief), near)
