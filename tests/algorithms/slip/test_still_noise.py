"""Noise of successive imprints: its variance, and whether it is steady."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.slip.imprint_tracker import NOISE, StillNoise


def after(changes: list[float], moved_mm: float = 0.0) -> StillNoise:
    noise = StillNoise()
    for change in changes:
        noise.update(change, moved_mm)
    return noise


def test_the_variance_is_that_of_the_most_similar_frames() -> None:
    assert np.isinf(StillNoise().variance)
    assert after([3.0, 2.0, 5.0]).variance == 2.0


def test_repeated_frames_have_no_noise() -> None:
    noise = after([0.0, 2.0, 0.0, 2.1, 0.0, 2.2, 0.0, 1.9])
    assert noise.variance == 1.9
    assert noise.steady


def test_the_noise_of_a_camera_is_steady_and_that_of_key_frames_is_not() -> None:
    assert after([1.0, 1.1, 0.95, 1.05, 1.1]).steady
    assert not after([0.1, 1.0, 0.9, 5.0, 1.0, 0.8]).steady


def test_changes_of_a_surface_that_moves_are_no_noise() -> None:
    noise = after([1.0, 1.1, 0.9])
    for _ in range(10):
        noise.update(20.0, 2 * NOISE.still_mm)
    assert noise.steady


def test_a_long_slip_of_a_still_surface_does_not_end_its_own_evidence() -> None:
    noise = after([1.0] * NOISE.first)
    for _ in range(10 * NOISE.first):
        noise.update(20.0, 0.0)
    assert noise.steady
    assert noise.variance == pytest.approx(1.0)
