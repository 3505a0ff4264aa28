"""Markers that all make a smooth step are followed as numpy follows them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import needs_kernels, seeds

from tactile_core.algorithms.marker_tracking import MarkerTracker
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.small_motion import steady

pytestmark = needs_kernels

REST_PX = 30.0 * np.stack(np.meshgrid(np.arange(14), np.arange(11)), axis=-1).reshape(-1, 2)
NONE_PX = np.zeros_like(REST_PX)


@given(seed=seeds, spurious=st.integers(0, 3), torn_at=st.integers(3, 8))
@settings(max_examples=8)
def test_tracks_agree(seed: int, spurious: int, torn_at: int) -> None:
    rng = np.random.default_rng(seed)
    steps_px = np.cumsum(rng.uniform(-4, 8, (8, 2)), axis=0)
    far = np.square(REST_PX - REST_PX.mean(axis=0)).sum(axis=1, keepdims=True)
    shown = []
    for frame, step_px in enumerate(steps_px):
        places = REST_PX + np.exp(-far / 2e4) * step_px + rng.normal(0, 0.1, REST_PX.shape)
        if frame == torn_at:
            places = places[rng.random(len(places)) > 0.1]
        clutter = rng.uniform(-60, -20, (spurious, 2))
        shown.append(rng.permutation(np.concatenate([places, clutter])))
    found = []
    for compiled in (True, False):
        tracker, track = MarkerTracker(REST_PX, compiled=compiled), []
        for places in shown:
            tracker.update(places)
            track.append(np.column_stack([tracker.px, tracker.seen]))
        found.append(track)
    np.testing.assert_allclose(*found, rtol=0, atol=1e-9)


def test_a_smooth_step_is_followed_and_predicts_the_next() -> None:
    around, step_px = Neighbourhood.of(REST_PX, compiled=True), np.array([3.0, 1.0])
    followed = steady(around, REST_PX, NONE_PX, (REST_PX + step_px)[::-1])
    assert followed is not None
    px, momentum_px = followed
    np.testing.assert_allclose(px, REST_PX + step_px)
    np.testing.assert_allclose(momentum_px, np.broadcast_to([2.1, 0.7], px.shape))


@pytest.mark.parametrize("fault", ["missing", "outlier", "far"])
def test_another_step_is_not(fault: str) -> None:
    around, found = Neighbourhood.of(REST_PX, compiled=True), REST_PX.copy()
    if fault == "missing":
        found[20] = [-500.0, -500.0]
    elif fault == "outlier":
        found[20] += 5.0
    else:
        found[:, 0] += 20.0
    assert steady(around, REST_PX, NONE_PX, found) is None
    assert steady(around, REST_PX, NONE_PX, found[1:]) is None
