"""The load without calibration: what changes it, and what does not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.force.elastic_layer import Elastomer
from tactile_core.algorithms.light.light_change import LIGHT_CHANGE, change_in_detail

SHAPE = 90, 120
THICKNESS_PX = 12.0
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float64)
SURFACE = 120 + 30 * np.sin(X / 40) + 10 * np.cos(Y / 5)


def lit(channels: int = 3) -> Array:
    """A surface under uneven light."""
    return np.asarray(np.repeat(SURFACE[..., None], channels, axis=2), np.float32)


def dent(amplitude: float, radius_px: float = 9.0) -> Array:
    """The relative change of light at a dent: brighter on one side, darker on the other."""
    x, y = X - 60, Y - 45
    return np.asarray(amplitude * x / radius_px * np.exp(-(x**2 + y**2) / radius_px**2 / 2))


def load(now: Array, before: Array, hidden: Array | None = None) -> float:
    return change_in_detail(now, before, hidden, THICKNESS_PX)


@given(st.lists(st.floats(0.7, 1.3), min_size=1, max_size=6), st.floats(0, 0.5))
def test_the_brightness_of_a_light_does_not_matter(gains: list[float], amplitude: float) -> None:
    before = lit(len(gains))
    pressed = before * (1 + dent(amplitude))[..., None]
    assert load(pressed * gains, before) == pytest.approx(load(pressed, before), abs=1e-6)


@given(st.floats(0.001, 0.02), st.floats(1.1, 2.0))
def test_the_load_is_proportional_to_small_slopes(amplitude: float, factor: float) -> None:
    before = lit()
    light, heavy = (
        load(before * (1 + dent(size))[..., None], before)
        for size in (amplitude, amplitude * factor)
    )
    assert light > 0
    assert heavy == pytest.approx(factor * light, rel=0.02)


@pytest.mark.parametrize("channels", [1, 3, 6])
def test_noise_alone_is_no_load_on_average(channels: int) -> None:
    rng = np.random.default_rng(channels)
    before = np.full((*SHAPE, channels), 100, np.float32)
    found = [load(before + rng.normal(0, 2, before.shape), before) for _ in range(20)]
    # relative noise of a cell of 3 × 3 px
    noise = 2 / 100 / 3
    assert abs(np.mean(found)) < 0.05 * noise
    assert np.std(found) < 0.05 * noise


@given(st.floats(0.01, 3.0))
def test_a_wave_is_kept_as_far_as_a_bonded_layer_gives_way_to_it(wave: float) -> None:
    gel = Elastomer(1.0, 0.145, 0.48)
    waves = np.array([wave, 60.0])
    slope, half_space = waves * gel.compliance(waves).normal
    kept = 1 - np.exp(-((wave * LIGHT_CHANGE.kept_thicknesses) ** 2) / 2)
    assert kept == pytest.approx(slope / half_space, abs=0.04)


def test_a_slow_change_of_the_light_is_no_load() -> None:
    before = lit()
    slow = before * (1 + 0.1 * np.sin(X / 120 * np.pi))[..., None]
    fine = before * (1 + 0.1 * np.sin(X / 12 * np.pi))[..., None]
    assert load(slow, before) < 0.1 * load(fine, before)


def test_what_a_marker_covers_does_not_matter() -> None:
    before, hidden = lit(), (X % 15 < 3) & (Y % 15 < 3)
    pressed = before * (1 + dent(0.2))[..., None]
    blackened = np.where(hidden[..., None], 0, pressed)
    assert load(blackened, before, hidden) == pytest.approx(load(pressed, before, hidden))
    assert load(blackened, before, hidden) == pytest.approx(load(pressed, before), rel=0.05)


def test_a_dark_frame_around_the_gel_does_not_matter() -> None:
    frame = (X < 21)[..., None]  # a whole number of cells
    before = np.where(frame, 3, lit())
    assert load(np.where(frame, 7, before), before) == 0


def test_in_the_dark_there_is_no_load() -> None:
    assert load(lit(), np.zeros_like(lit())) == 0
