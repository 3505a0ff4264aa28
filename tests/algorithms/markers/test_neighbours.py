"""Mutual nearest neighbours, and the predictions of the neighbourhood."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from tactile_core.algorithms.markers.neighbourhood import (
    UNMATCHED,
    Neighbourhood,
    pair_nearest,
)

PITCH_PX = 20.0
PLACES = PITCH_PX * np.stack(np.meshgrid(np.arange(12), np.arange(9)), -1).reshape(-1, 2)


@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.floats(0, 40))
def test_matches_are_mutual_nearest_neighbours(seed: int, found: int, within: float) -> None:
    rng = np.random.default_rng(seed)
    markers, detections = rng.uniform(0, 100, (20, 2)), rng.uniform(0, 100, (found, 2))
    within_px = np.where(rng.random(20) < 0.8, within, -1.0)
    owner = pair_nearest(markers, detections, within_px)
    expected = np.full(20, UNMATCHED)
    seeking = np.flatnonzero(within_px >= 0)
    if found and len(seeking):
        apart = cdist(markers, detections)
        wanted = apart.argmin(axis=1)
        for detection in range(found):
            rivals = [marker for marker in seeking if wanted[marker] == detection]
            nearest = min(rivals, key=lambda marker, at=detection: apart[marker, at], default=None)
            if nearest is not None and apart[nearest, detection] <= within:
                expected[nearest] = detection
    np.testing.assert_array_equal(owner, expected)


def test_extrapolation_gets_worse_with_distance() -> None:
    around = Neighbourhood.from_places(PLACES)
    column = PLACES[:, 0] / PITCH_PX
    inner = (PLACES[:, 1] > 2 * PITCH_PX) & (PLACES[:, 1] < 6 * PITCH_PX)
    beyond = around.extrapolation(column <= 5)
    assert (beyond[inner & (column > 1) & (column < 4)] == 1).all()
    assert (beyond[inner & (column == 7)] > 1.5).all()
