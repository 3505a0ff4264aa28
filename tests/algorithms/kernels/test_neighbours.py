"""The kernels of neighbours agree with numpy, which is the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.kernel_agreement import both_ways, needs_kernels, seeds, several

from tactile_core.algorithms.marker_tracking import MarkerTracker
from tactile_core.algorithms.marker_tracking.neighbourhood import Neighbourhood
from tactile_core.algorithms.marker_tracking.pairing import paired

pytestmark = needs_kernels


@given(seeds)
@several
def test_neighbours_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, found = rng.uniform(0, 300, (40, 2)), rng.uniform(0, 300, (35, 2))
    values, trust = rng.normal(size=(40, 2)), rng.uniform(0, 1, 40)
    gates = np.where(rng.random(40) < 0.2, -1.0, rng.uniform(5, 60, 40))
    fast, plain = both_ways(lambda c: Neighbourhood.of(places, compiled=c).fit(values, trust))
    assert fast == pytest.approx(plain, abs=1e-6)
    fast, plain = both_ways(
        lambda c: Neighbourhood.of(places, compiled=c).spacing_px(places + values)
    )
    assert fast == pytest.approx(plain, abs=1e-6)
    fast, plain = both_ways(lambda c: paired(places, found, gates, compiled=c))
    np.testing.assert_array_equal(fast, plain)


@given(seeds, st.sampled_from([0.0, 0.05, 0.3]))
@settings(max_examples=6)
def test_tracks_agree(seed: int, missing: float) -> None:
    rng = np.random.default_rng(seed)
    rest = 30.0 * np.stack(np.meshgrid(np.arange(14), np.arange(11)), axis=-1).reshape(-1, 2)
    far = np.square(rest - rest.mean(axis=0)).sum(axis=1, keepdims=True)
    shear = np.exp(-far / 2e4) * [7.5, 3.0]
    shown = [
        (rest + shear * k + rng.normal(0, 0.2, rest.shape))[rng.random(len(rest)) >= missing]
        for k in range(6)
    ]

    def followed(compiled: bool) -> list[np.ndarray]:
        tracker, tracks = MarkerTracker(rest, compiled=compiled), []
        for found in shown:
            tracker.update(found)
            tracks.append(np.column_stack([tracker.px, tracker.seen]))
        return tracks

    fast, plain = both_ways(followed)
    np.testing.assert_allclose(fast, plain, rtol=0, atol=1e-6)
