import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.heights.sphere import BallPress

SCALE = 0.05


@given(diameter=st.floats(2, 8), share=st.floats(0.05, 0.35))
def test_the_gel_follows_the_ball_inside_the_contact(diameter: float, share: float) -> None:
    press = BallPress((60.0, 50.0), diameter, share * diameter)
    height = press.height_mm((100, 120), SCALE)
    r = np.hypot(np.arange(120) - 60.0, np.arange(100)[:, None] - 50.0) * SCALE
    inside = r < press.contact_radius_mm
    ball = np.sqrt((diameter / 2) ** 2 - r[inside] ** 2)
    assert np.ptp(height[inside] - ball) < 1e-9


def test_the_gel_has_no_step_and_no_kink_at_the_border() -> None:
    press = BallPress((200.0, 0.0), 4.0, 0.8)
    profile = press.height_mm((1, 401), 0.005)[0]
    slope = np.diff(profile) / 0.005
    assert np.abs(np.diff(profile)).max() < 0.01
    assert np.abs(np.diff(slope)).max() < 0.02


def test_the_gel_is_undeformed_far_from_the_ball() -> None:
    height = BallPress((0.0, 0.0), 4.0, 0.8).height_mm((1, 400), SCALE)
    assert height[0, -1] < 1e-6
