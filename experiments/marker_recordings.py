"""Markers of recordings, detected and tracked from the first frame on."""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tactile_core import MarkerField, Reading, open_sensor
from tactile_core.algorithms.marker_tracking import MarkerTracker

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
    """The markers of every frame."""
    return [reading[MarkerField] for reading in read(source, size)]


def read(source: Path, size: tuple[int, int]) -> list[Reading]:
    """Every frame as a profile's chain tells it, the first being the reference."""
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "marked.yaml"
        profile.write_text(PROFILE.format(*size), encoding="utf-8")
        with open_sensor(profile, input=source, reference="first") as sensor:
            return list(sensor.stream())


def through(fields: list[MarkerField]) -> NDArray[np.bool_]:
    """Which markers are seen in all frames."""
    return np.asarray(np.all([field.seen for field in fields], axis=0))


def against_labels(data: Path, fields: list[MarkerField]) -> tuple[Array, int]:
    """(T, N) distances from the labels, px, and how many markers are nearer to another's."""
    labels = _labels(data / "markers" / "mini" / "markers.csv")
    told = {number + LABELS_LAG: places for number, places in labels.items()}
    images = [number for number in sorted(told) if number < len(fields)]
    ids = KDTree(fields[images[0]].px).query(told[images[0]])[1]
    places = [fields[number].px[ids] for number in images]
    off_px = np.array([np.hypot(*(p - told[k]).T) for p, k in zip(places, images, strict=True)])
    nearest = [KDTree(told[k]).query(p)[1] for p, k in zip(places, images, strict=True)]
    return off_px, int(np.count_nonzero(np.array(nearest) != np.arange(len(ids))))


def thinned(
    fields: list[MarkerField], missing: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Follow what is left of the markers of each frame: (T, N, 2) places, (T, N) whether seen."""
    tracker = MarkerTracker(fields[0].px)
    places, seen = [], []
    for field in fields:
        tracker.update(field.px[rng.random(len(field.px)) >= missing])
        places.append(tracker.px.copy())
        seen.append(tracker.seen.copy())
    return np.array(places), np.array(seen)


def _labels(path: Path) -> dict[int, Array]:
    """Places (N, 2) that another tracker gave, by its frame."""
    frames: dict[int, list[tuple[float, float]]] = {}
    with path.open() as rows:
        for row in csv.DictReader(rows):
            place = float(row["x_px"]), float(row["y_px"])
            frames.setdefault(int(row["frame"]), []).append(place)
    return {number: np.array(places) for number, places in frames.items()}
