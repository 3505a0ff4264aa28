"""Drift is what the resting skin shows, and never the contact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.drift import channel_gains, divided

pytestmark = pytest.mark.usefixtures("kernels_or_numpy")

ROWS, COLUMNS = 120, 160
UNDEFORMED = np.random.default_rng(0).uniform(80, 140, (ROWS, COLUMNS, 6)).astype(np.float32)
AZIMUTHS = np.radians(np.arange(6) * 60.0)


def ball(radius_px: float) -> np.ndarray:
    """Light on a ball at the centre: brighter towards each lamp, by its slope."""
    y, x = np.mgrid[:ROWS, :COLUMNS] - np.array([ROWS / 2, COLUMNS / 2]).reshape(2, 1, 1)
    inside = np.hypot(x, y) < radius_px
    slope = (x[..., None] * np.cos(AZIMUTHS) + y[..., None] * np.sin(AZIMUTHS)) / radius_px
    return 1 + 0.6 * slope * inside[..., None]


def eight_bit(pixels: np.ndarray) -> np.ndarray:
    return np.clip(np.round(pixels), 0, 255).astype(np.uint8)


@given(st.lists(st.floats(0.94, 1.06), min_size=6, max_size=6))
def test_each_lights_drift_is_found_beside_a_ball(gains: list[float]) -> None:
    seen = eight_bit(UNDEFORMED * ball(35) * gains)
    np.testing.assert_allclose(channel_gains(seen, UNDEFORMED, 255), gains, rtol=0.003)


def test_a_ball_held_for_ten_minutes_stays_while_the_lights_drift() -> None:
    held = UNDEFORMED * ball(40)
    for minute in range(11):
        drift = 1 + 0.005 * minute * np.array([1, -1, 0.5, 1, 0, -0.5])
        gains = channel_gains(eight_bit(held * drift), UNDEFORMED, 255)
        np.testing.assert_allclose(gains, drift, rtol=0.003)


def test_a_contact_without_gel_at_rest_is_left_alone() -> None:
    assert (channel_gains(eight_bit(UNDEFORMED * ball(200)), UNDEFORMED, 255) == 1).all()


@pytest.mark.parametrize(("dtype", "full_scale"), [("u1", 255), ("u2", 4095), ("f4", 255)])
@pytest.mark.parametrize("planar", [False, True])
def test_a_frame_is_brought_back_to_the_light_of_the_reference(
    dtype: str, full_scale: int, planar: bool
) -> None:
    gains = np.array([0.93, 1.0, 1.07], np.float32)
    at_rest = np.random.default_rng(1).uniform(0.1, 0.8, (30, 40, 3)) * full_scale
    seen = np.rint(at_rest * gains).astype(dtype)
    if planar:
        seen = np.ascontiguousarray(seen.transpose(2, 0, 1)).transpose(1, 2, 0)
    followed = divided(seen, gains, full_scale)
    assert followed.dtype == seen.dtype
    np.testing.assert_allclose(followed, at_rest, atol=1.1)


@pytest.mark.parametrize("dtype", ["u1", "f4"])
def test_what_is_saturated_stays_so_whatever_the_light_does(dtype: str) -> None:
    seen = np.full((4, 5, 3), 255, dtype)
    assert (divided(seen, np.array([0.92, 1.0, 1.08]), 255) == 255).all()
