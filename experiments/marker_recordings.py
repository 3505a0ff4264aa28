"""Marker detection and tracking on recordings, from the first frame on."""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tactile_core import MarkerField, Reading, open_sensor
from tactile_core.algorithms.markers.tracker import MarkerTracker

Array = NDArray[Any]

PROFILE = """\
schema: 1
name: marked
image: {{width_px: {}, height_px: {}, mm_per_px: 0.05}}
gel: {{markers: auto}}
estimators:
  markers: {{use: core.markers}}
  tracking: {{use: core.marker_tracking}}
"""
MINI, MINI_SIZE = "markers/mini/frames", (320, 240)
IRREGULAR, IRREGULAR_SIZE = "markers/irregular_markers.avi", (960, 720)
LIFTS, LIFT_SIZE = "slip/grasp_lift", (640, 480)
UNDEFORMED, UNDEFORMED_SIZE = "three_colour/hex_fingertip/frame0.jpg", (640, 480)
LABELS_LAG = 9
"""The labels of frame k belong to image k + 9."""


def followed(source: Path, size: tuple[int, int]) -> list[MarkerField]:
    """Tracked markers of every frame."""
    return [reading[MarkerField] for reading in read(source, size)]


def read(source: Path, size: tuple[int, int]) -> list[Reading]:
    """Readings of every frame by a profile's chain; the first frame is the reference."""
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "marked.yaml"
        profile.write_text(PROFILE.format(*size), encoding="utf-8")
        with open_sensor(profile, input=source, reference="first") as sensor:
            return list(sensor.stream())


def through(fields: list[MarkerField]) -> NDArray[np.bool_]:
    """(N,) markers that are detected in all frames."""
    return np.asarray(np.all([field.seen for field in fields], axis=0))


def against_labels(data: Path, fields: list[MarkerField]) -> tuple[Array, int]:
    """(T, N) distances from the labels, px, and number of markers closer to another's label."""
    frames = _labels(data / "markers" / "mini" / "markers.csv")
    labels = {number + LABELS_LAG: positions for number, positions in frames.items()}
    images = [number for number in sorted(labels) if number < len(fields)]
    ids = KDTree(fields[images[0]].px).query(labels[images[0]])[1]
    tracked = [fields[number].px[ids] for number in images]
    off_px = np.array([np.hypot(*(p - labels[k]).T) for p, k in zip(tracked, images, strict=True)])
    nearest = [KDTree(labels[k]).query(p)[1] for p, k in zip(tracked, images, strict=True)]
    return off_px, int(np.count_nonzero(np.array(nearest) != np.arange(len(ids))))


def thinned(
    fields: list[MarkerField], missing: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Track markers with random missing detections: (T, N, 2) positions, (T, N) detected."""
    tracker = MarkerTracker(fields[0].px)
    positions, seen = [], []
    for field in fields:
        tracker.update(field.px[rng.random(len(field.px)) >= missing])
        positions.append(tracker.px.copy())
        seen.append(tracker.seen.copy())
    return np.array(positions), np.array(seen)


def _labels(path: Path) -> dict[int, Array]:
    """(N, 2) marker positions of another tracker, by its frame number."""
    frames: dict[int, list[tuple[float, float]]] = {}
    with path.open() as rows:
        for row in csv.DictReader(rows):
            position = float(row["x_px"]), float(row["y_px"])
            frames.setdefault(int(row["frame"]), []).append(position)
    return {number: np.array(positions) for number, positions in frames.items()}
