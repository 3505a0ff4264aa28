"""The apparent tilt of gel under a press, as a function of position and slopes in view."""

import numpy as np
import pytest

from tactile_core.algorithms.slopes.slope_grid import PressLight


def sloped(share: float) -> np.ndarray:
    """Normals of a view of which this share is sloped."""
    normal_xy = np.zeros((2, 100, 100))
    normal_xy[0, : round(100 * share)] = 0.5
    return normal_xy


def test_the_tilt_is_proportional_to_the_slopes_in_view_and_at_most_that_of_the_calibration() -> (
    None
):
    light = PressLight(np.zeros((2, 6), np.float32), steep_share=0.2)
    found = [float(light.strength(sloped(share))) for share in (0.0, 0.1, 0.2, 0.6)]
    assert found == pytest.approx([0, 0.5, 1, 1])
    assert PressLight(light.tilt, steep_share=0.0).strength(sloped(0.1)) == 0


def test_the_tilt_is_a_quadratic_of_the_position() -> None:
    tilt = np.zeros((2, 6), np.float32)
    tilt[0, :3] = 1, 2, 3
    tilt[1, 5] = 4
    x, y = PressLight(tilt, 0.1).tilt_at(np.array([[0.5, -1.0]], np.float32))
    assert x == pytest.approx(1 + 2 * 0.5 - 3)
    assert y == pytest.approx(4)
