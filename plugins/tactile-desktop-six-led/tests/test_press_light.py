"""The apparent tilt of gel under a press, as a function of position and slopes in view."""

import numpy as np
import pytest

from tactile_desktop_six_led.press_light import PressLight


def test_the_tilt_is_proportional_to_the_slopes_in_view_and_at_most_that_of_the_calibration() -> (
    None
):
    light = PressLight(np.zeros((2, 6), np.float32), steep_share=0.2)
    assert [float(light.strength(share)) for share in (0.0, 0.1, 0.2, 0.6)] == pytest.approx(
        [0, 0.5, 1, 1]
    )
    assert PressLight(light.tilt, steep_share=0.0).strength(0.1) == 0


def test_the_tilt_is_a_quadratic_of_the_position() -> None:
    tilt = np.zeros((2, 6), np.float32)
    tilt[0, :3] = 1, 2, 3
    tilt[1, 5] = 4
    x, y = PressLight(tilt, 0.1).tilt_at(np.array([[0.5, -1.0]], np.float32))
    assert x == pytest.approx(1 + 2 * 0.5 - 3)
    assert y == pytest.approx(4)
