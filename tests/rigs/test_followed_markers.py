"""Markers of real recordings, detected and tracked from the first frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from experiments.marker_recordings import (
    IRREGULAR,
    IRREGULAR_SIZE,
    MINI,
    MINI_SIZE,
    followed,
    thinned,
    through,
)

pytest.importorskip("tactile_core.builtin.contact", reason="no step of the core detects markers")


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "size", "share"),
    [
        (MINI, MINI_SIZE, 0.995),
        (IRREGULAR, IRREGULAR_SIZE, 0.97),
        ("slip/grasp_lift/object001/067_30_mm", (640, 480), 0.98),
    ],
)
def test_markers_are_tracked_through_all_frames(
    recordings: Path, name: str, size: tuple[int, int], share: float
) -> None:
    fields = followed(recordings / name, size)
    assert through(fields).mean() >= share
    for field in fields[1:]:
        np.testing.assert_array_equal(field.ids, fields[0].ids)


@pytest.mark.recordings
def test_interpolated_markers_are_near_their_detections(recordings: Path) -> None:
    fields = followed(recordings / MINI, MINI_SIZE)
    full = np.array([field.px for field in fields])
    places, seen = thinned(fields, 0.3, np.random.default_rng(0))
    distance = np.hypot(*np.moveaxis(places - full, -1, 0))
    assert distance[seen].max() < 1e-3
    assert np.percentile(distance[~seen], 95) < 1
