"""Drift is estimated from the undeformed surface, never from the contact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.light.drift import channel_gains, divide_by_gains

ROWS, COLUMNS = 120, 160
UNDEFORMED = np.random.default_rng(0).uniform(80, 140, (ROWS, COLUMNS, 6)).astype(np.float32)
AZIMUTHS = np.radians(np.arange(6) * 60.0)


def ball(radius_px: float) -> np.ndarray:
    """Relative intensity on a ball at the centre: brighter where it faces a light."""
    y, x = np.mgrid[:ROWS, :COLUMNS] - np.array([ROWS / 2, COLUMNS / 2]).reshape(2, 1, 1)
    inside = np.hypot(x, y) < radius_px
    slope = (x[..., None] * np.cos(AZIMUTHS) + y[..., None] * np.sin(AZIMUTHS)) / radius_px
    return 1 + 0.6 * slope * inside[..., None]


def eight_bit(pixels: np.ndarray) -> np.ndarray:
    return np.clip(np.round(pixels), 0, 255).astype(np.uint8)


@given(st.lists(st.floats(0.94, 1.06), min_size=6, max_size=6))
def test_the_drift_of_each_light_is_found_next_to_a_ball(gains: list[float]) -> None:
    seen = eight_bit(UNDEFORMED * ball(35) * gains)
    np.testing.assert_allclose(channel_gains(seen, UNDEFORMED, 255), gains, rtol=0.003)


def test_a_ball_held_for_ten_minutes_is_not_absorbed_while_the_lights_drift() -> None:
    held = UNDEFORMED * ball(40)
    for minute in range(11):
        drift = 1 + 0.005 * minute * np.array([1, -1, 0.5, 1, 0, -0.5])
        gains = channel_gains(eight_bit(held * drift), UNDEFORMED, 255)
        np.testing.assert_allclose(gains, drift, rtol=0.003)


def test_a_contact_without_undeformed_surface_gives_no_gain() -> None:
    assert (channel_gains(eight_bit(UNDEFORMED * ball(200)), UNDEFORMED, 255) == 1).all()


@pytest.mark.parametrize(("dtype", "full_scale"), [("u1", 255), ("u2", 4095), ("f4", 255)])
@pytest.mark.parametrize("planar", [False, True])
def test_a_frame_is_brought_back_to_the_light_of_the_reference(
    dtype: str, full_scale: int, planar: bool
) -> None:
    gains = np.array([0.93, 1.0, 1.07], np.float32)
    undeformed = np.random.default_rng(1).uniform(0.1, 0.8, (30, 40, 3)) * full_scale
    seen = np.rint(undeformed * gains).astype(dtype)
    if planar:
        seen = np.ascontiguousarray(seen.transpose(2, 0, 1)).transpose(1, 2, 0)
    compensated = divide_by_gains(seen, gains, full_scale)
    assert compensated.dtype == seen.dtype
    np.testing.assert_allclose(compensated, undeformed, atol=1.1)


@pytest.mark.parametrize("dtype", ["u1", "f4"])
def test_saturated_intensities_stay_saturated_whatever_the_gain(dtype: str) -> None:
    seen = np.full((4, 5, 3), 255, dtype)
    assert (divide_by_gains(seen, np.array([0.92, 1.0, 1.08]), 255) == 255).all()
