import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.virtual_lab import VirtualLab

from tactile_core.sim.analytic_ball import BallPress, render

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


def test_images_are_reproducible_by_seed(lab: VirtualLab) -> None:
    flat = np.zeros((120, 160))
    same = [render(lab.profile, flat, seed=4) for _ in range(2)]
    np.testing.assert_array_equal(*same)
    assert (same[0] != render(lab.profile, flat, seed=5)).any()


def test_a_surface_that_faces_a_light_is_brighter_in_its_colour(lab: VirtualLab) -> None:
    # Red comes from azimuth 90°, the bottom: a surface that descends towards +y faces it.
    y = np.arange(120)[:, None] * lab.profile.image.mm_per_px * np.ones(160)
    flat, facing = (render(lab.profile, s * y)[..., 0].mean() for s in (0.0, -0.2))
    assert facing > flat
