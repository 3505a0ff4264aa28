"""Markers that all make a small, smooth step are followed as one by one, and others are not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.marker_tracking import MarkerTracker, tracker
from tactile_core.algorithms.marker_tracking.growth import steady
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import closest_of, nearest

REST_PX = 30.0 * np.stack(np.meshgrid(np.arange(14), np.arange(11)), axis=-1).reshape(-1, 2)
NONE_PX = np.zeros_like(REST_PX)


def tracks(shown: list[Array]) -> Array:
    """Place and visibility of every marker in every frame, (F, N, 3)."""
    follower, found = MarkerTracker(REST_PX), []
    for places in shown:
        follower.update(places)
        found.append(np.column_stack([follower.px, follower.seen]))
    return np.stack(found)


@given(seed=st.integers(0, 2**16), spurious=st.integers(0, 3), torn_at=st.integers(3, 8))
@settings(max_examples=8, deadline=None)
def test_markers_are_followed_together_as_one_by_one(
    seed: int, spurious: int, torn_at: int
) -> None:
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
    together = tracks(shown)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tracker, "steady", lambda *_: None)
        one_by_one = tracks(shown)
    np.testing.assert_allclose(together, one_by_one, rtol=0, atol=1e-9)


def test_a_smooth_step_is_followed_and_predicts_the_next() -> None:
    around, step_px = Neighbourhood.from_places(REST_PX), np.array([3.0, 1.0])
    followed = steady(around, REST_PX, NONE_PX, (REST_PX + step_px)[::-1])
    assert followed is not None
    px, momentum_px = followed
    np.testing.assert_allclose(px, REST_PX + step_px)
    np.testing.assert_allclose(momentum_px, np.broadcast_to([2.1, 0.7], px.shape))


@pytest.mark.parametrize("fault", ["missing", "outlier", "far", "twice"])
def test_another_step_is_not(fault: str) -> None:
    around, found = Neighbourhood.from_places(REST_PX), REST_PX.copy()
    if fault == "missing":
        found[20] = [-500.0, -500.0]
    elif fault == "outlier":
        found[20] += 5.0
    elif fault == "far":
        found[:, 0] += 20.0
    else:
        # halfway between two markers, of which the other detection is gone
        found[20], found[21] = (found[20] + found[21]) / 2, [-500.0, -500.0]
    assert steady(around, REST_PX, NONE_PX, found) is None
    assert steady(around, REST_PX, NONE_PX, found[1:]) is None


def test_the_closest_point_is_that_of_a_tree() -> None:
    rng = np.random.default_rng(0)
    places, among = rng.uniform(0, 640, (300, 2)), rng.uniform(0, 640, (200, 2))
    assert (closest_of(places, among) == nearest(places, among, 1)[1][:, 0]).all()
