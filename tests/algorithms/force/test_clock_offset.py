"""The clock of a load cell relative to the camera's."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.clock_offset import clock_offset


def pressed(time_s: Float64) -> Float64:
    """Force of presses that come at irregular times."""
    return np.asarray(sum(np.exp(-(((time_s - at) / 0.3) ** 2)) for at in (1.0, 2.7, 3.6, 5.9)))


@pytest.mark.parametrize("offset_s", [0.0, 0.237, -0.61, 1234.5])
def test_the_offset_is_found_between_two_frames(offset_s: float) -> None:
    frames_s, times_s = np.arange(0, 7, 1 / 30), np.arange(-1, 8, 1 / 500)
    rng = np.random.default_rng(0)
    features = np.stack([3 * pressed(frames_s), rng.normal(size=len(frames_s))], 1)
    found = clock_offset(frames_s, features, times_s + offset_s, pressed(times_s))
    assert found.found
    assert found.offset_s == pytest.approx(offset_s, abs=0.004)


def test_forces_of_another_recording_have_no_offset() -> None:
    frames_s = np.arange(0, 7, 1 / 30)
    noise = np.random.default_rng(1).normal(size=(len(frames_s), 2))
    times_s = np.arange(0, 7, 0.01)
    assert not clock_offset(frames_s, noise, times_s, pressed(times_s)).found
