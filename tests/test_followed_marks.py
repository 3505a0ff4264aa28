"""Marks of real recordings, found and followed from the first frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core import MarkerField, open_sensor

pytest.importorskip("tactile_core.builtin.markers", reason="no step of the core detects marks")

PROFILE = """\
schema: 1
name: marked
image: {{width_px: {}, height_px: {}, mm_per_px: 0.05}}
gel: {{markers: auto}}
estimators:
  markers: {{use: core.markers}}
  tracking: {{use: core.tracking}}
"""


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "size", "share"),
    [
        ("markers/mini/frames", (320, 240), 0.995),
        ("markers/irregular_markers.avi", (960, 720), 0.97),
        ("slip/grasp_lift/object001/067_30_mm", (640, 480), 0.98),
    ],
)
def test_marks_are_kept_through_all_frames(
    recordings: Path, tmp_path: Path, name: str, size: tuple[int, int], share: float
) -> None:
    profile = tmp_path / "marked.yaml"
    profile.write_text(PROFILE.format(*size), encoding="utf-8")
    with open_sensor(profile, input=recordings / name, reference="first") as sensor:
        fields = [reading[MarkerField] for reading in sensor.stream()]
    through = np.all([field.seen for field in fields], axis=0)
    assert through.mean() >= share
    for field in fields[1:]:
        np.testing.assert_array_equal(field.ids, fields[0].ids)
