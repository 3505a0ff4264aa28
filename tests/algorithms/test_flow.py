"""Imprints that are moved by known amounts."""

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
SKIN = np.full((*SHAPE, 3), 120.0)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
WINDOW = np.exp(-((((X - 160) / 70) ** 2 + ((Y - 120) / 60) ** 2) ** 4))
TEXTURE = gaussian_filter(RNG.normal(0, 1, SHAPE), 2.0) * WINDOW * 120
NOTHING = np.zeros((*SHAPE, 2), np.float32)
INSIDE = np.hypot(X - 160, Y - 120) < 40


def seen(texture: NDArray[np.float64], light: float = 1.0, seed: int = 0) -> flow.Imprint:
    """An imprint on even skin under noise; the light has drifted since the skin was untouched."""
    noise = np.random.default_rng(seed).normal(0, 1.0, SKIN.shape)
    pixels = np.clip(light * (SKIN + texture[..., None]) + noise, 0, 255).astype(np.uint8)
    return flow.imprint(flow.detail(pixels, 255.0), flow.detail(SKIN.astype(np.float32), 255.0))


@settings(max_examples=6)
@given(st.floats(-6, 6), st.floats(-6, 6), st.floats(0.8, 1.2))
def test_a_shifted_imprint_is_followed_whatever_the_light(x: float, y: float, light: float) -> None:
    moved = flow.motion(seen(TEXTURE), seen(shift(TEXTURE, (y, x)), light, 1), NOTHING)
    np.testing.assert_allclose(np.median(moved[INSIDE], axis=0), [x, y], atol=0.4)


def test_noise_alone_has_no_weight() -> None:
    assert seen(0 * TEXTURE, 1.1).weight.max() < 0.1
    assert seen(TEXTURE).weight[INSIDE].min() > 0.8


def test_what_shows_nothing_moves_as_its_surroundings_and_far_away_not_at_all() -> None:
    weight = INSIDE.astype(np.float32)
    moved = np.where(INSIDE[..., None], np.float32([3, 1]), np.float32(50))
    found = flow.settled(moved, weight, reach_px=10.0)
    np.testing.assert_allclose(found[INSIDE], np.broadcast_to([3, 1], found[INSIDE].shape))
    beside = np.hypot(X - 160, Y - 120) < 42
    assert (found[beside & ~INSIDE, 0] > 1.5).all()
    assert np.abs(found[:, :60]).max() < 0.01


@given(st.floats(-9, 9), st.floats(-9, 9))
def test_two_motions_add_up_where_the_gel_is_now(x: float, y: float) -> None:
    second = np.broadcast_to(np.float32([x, y]), NOTHING.shape)
    first = 0.01 * np.stack([X, Y], -1).astype(np.float32)
    found = flow.followed(first, second)
    inner = np.s_[12:-12, 12:-12]
    wanted = np.stack([X, Y], -1) - np.array([x, y])
    np.testing.assert_allclose(found[inner], (second + 0.01 * wanted)[inner], atol=1e-3)


@pytest.mark.parametrize("channels", [1, 3, 6])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_any_picture_will_do(channels: int, dtype: type) -> None:
    pixels = np.full((96, 700, channels), 50, dtype)
    found = flow.detail(pixels, 100.0)
    assert found.shape == (44, 320)
    assert np.abs(found).max() < 1e-5
