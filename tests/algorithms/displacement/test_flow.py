"""Optical flow of imprints that are moved by known amounts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, shift

from tactile_core.algorithms.displacement import flow

SHAPE = (240, 320)
RNG = np.random.default_rng(5)
GEL = np.full((*SHAPE, 3), 120.0)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
WINDOW = np.exp(-((((X - 160) / 70) ** 2 + ((Y - 120) / 60) ** 2) ** 4))
TEXTURE = gaussian_filter(RNG.normal(0, 1, SHAPE), 2.0) * WINDOW * 120
NOTHING = np.zeros((*SHAPE, 2), np.float32)
INSIDE = np.hypot(X - 160, Y - 120) < 40


def seen(texture: NDArray[np.float64], light: float = 1.0, seed: int = 0) -> flow.TextureImprint:
    """An imprint on a uniform gel with noise and illumination drift."""
    noise = np.random.default_rng(seed).normal(0, 1.0, GEL.shape)
    pixels = np.clip(light * (GEL + texture[..., None]) + noise, 0, 255).astype(np.uint8)
    return flow.imprint(flow.detail(pixels, 255.0), flow.detail(GEL.astype(np.float32), 255.0))


@settings(max_examples=6)
@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(0.8, 1.2))
def test_a_shift_is_estimated_under_illumination_drift(x: float, y: float, light: float) -> None:
    moved = flow.motion(seen(TEXTURE), seen(shift(TEXTURE, (y, x)), light, 1), NOTHING)
    np.testing.assert_allclose(np.median(moved[INSIDE], axis=0), [x, y], atol=0.4)


def test_noise_alone_has_no_weight() -> None:
    assert seen(0 * TEXTURE, 1.1).weight.max() < 0.1
    assert seen(TEXTURE).weight[INSIDE].min() > 0.8


def test_motion_without_texture_is_extrapolated_and_fades_with_distance() -> None:
    weight = INSIDE.astype(np.float32)
    moved = np.where(INSIDE[..., None], np.float32([3, 1]), np.float32(50))
    found = flow.fill_untextured(moved, weight, reach_px=10.0)
    np.testing.assert_allclose(found[INSIDE], np.broadcast_to([3, 1], found[INSIDE].shape))
    near = np.hypot(X - 160, Y - 120) < 42
    assert (found[near & ~INSIDE, 0] > 1.5).all()
    assert np.abs(found[:, :60]).max() < 0.01


@given(st.floats(-9, 9), st.floats(-9, 9))
def test_composed_motion_refers_to_the_present_position(x: float, y: float) -> None:
    second = np.broadcast_to(np.float32([x, y]), NOTHING.shape)
    first = 0.01 * np.stack([X, Y], -1).astype(np.float32)
    found = flow.compose_motions(first, second)
    inner = np.s_[12:-12, 12:-12]
    wanted = np.stack([X, Y], -1) - np.array([x, y])
    np.testing.assert_allclose(found[inner], (second + 0.01 * wanted)[inner], atol=1e-3)


@pytest.mark.parametrize("channels", [1, 3, 6])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_any_dtype_and_channel_count_is_accepted(channels: int, dtype: type) -> None:
    pixels = np.full((96, 700, channels), 50, dtype)
    found = flow.detail(pixels, 100.0)
    assert found.shape == (44, 320)
    assert np.abs(found).max() < 1e-5
