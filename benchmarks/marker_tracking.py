"""Marks followed: ``python benchmarks/marker_tracking.py [DATA] [--frames N] [--seed S]``.

The real rows find marks with ``core.markers`` and follow them with ``core.tracking`` from the first
frame on; the labels of ``markers/mini`` are another tracker's. The virtual rows follow marks of a
skin that is dragged, of which a third is missing, among specks.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from dragged_marks import Drag, counted
from numpy.typing import NDArray
from scipy.spatial import KDTree

from tactile_core import MarkerDetections, MarkerField, Reading, open_sensor
from tactile_core.algorithms import kernels
from tactile_core.algorithms.tracking import MarkTracker

Array = NDArray[Any]

ROOT = Path(__file__).resolve().parents[1]
PROFILE = """\
schema: 1
name: marked
image: {{width_px: {}, height_px: {}, mm_per_px: 0.05}}
gel: {{markers: auto}}
estimators:
  markers: {{use: core.markers}}
  tracking: {{use: core.tracking}}
"""
MINI, MINI_SIZE = "markers/mini/frames", (320, 240)
IRREGULAR, IRREGULAR_SIZE = "markers/irregular_markers.avi", (960, 720)
LIFTS, LIFT_SIZE = "slip/grasp_lift", (640, 480)
UNTOUCHED, UNTOUCHED_SIZE = "three_colour/hex_fingertip/frame0.jpg", (640, 480)
LABELS_LAG = 9
"""The labels of frame k belong to image k + 9."""

DRAGS = {
    "to 1 pitch, 0.35 a frame": Drag(1.0, 0.35, spurious=0.05),
    "to 2 pitches, 0.35 a frame": Drag(2.0, 0.35, spurious=0.02),
    "to 2 pitches, 0.35 a frame, no speck": Drag(2.0, 0.35, spurious=0.0),
    "to 2 pitches, 0.7 a frame": Drag(2.0, 0.7, spurious=0.05),
}


def main() -> None:
    """Print a line for each recording and each way of dragging."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--frames", type=int, default=1000, help="of each virtual row")
    parser.add_argument("--seed", type=int, default=0, help="of the first virtual stroke")
    options = parser.parse_args()
    kernels.load()
    if options.data.is_dir():
        mini(options.data)
        kept = through(followed(options.data / IRREGULAR, IRREGULAR_SIZE))
        print(f"irregular_markers: {kept.mean():.1%} of {kept.size} through all frames")
        lifts = [
            through(followed(folder, LIFT_SIZE)).mean()
            for folder in sorted((options.data / LIFTS).glob("object*/*_mm"))
        ]
        print(
            f"grasp_lift: {np.mean(lifts):.1%} through all frames (mean of {len(lifts)}),"
            f" worst {min(lifts):.1%}"
        )
        count = len(read(options.data / UNTOUCHED, UNTOUCHED_SIZE)[0][MarkerDetections].centres_px)
        print(f"hex_fingertip/frame0: {count} found (90 told of, among them 3-4 spurious)")
    for name, drag in DRAGS.items():
        print(f"virtual, {name}: {counted(drag, options.frames, options.seed)}")


def followed(source: Path, size: tuple[int, int]) -> list[MarkerField]:
    """The marks of every frame."""
    return [reading[MarkerField] for reading in read(source, size)]


def read(source: Path, size: tuple[int, int]) -> list[Reading]:
    """Every frame as a profile's chain tells it, the first being the reference."""
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "marked.yaml"
        profile.write_text(PROFILE.format(*size), encoding="utf-8")
        with open_sensor(profile, input=source, reference="first") as sensor:
            return list(sensor.stream())


def through(fields: list[MarkerField]) -> NDArray[np.bool_]:
    """Which marks are seen in all frames."""
    return np.asarray(np.all([field.seen for field in fields], axis=0))


def against_labels(data: Path, fields: list[MarkerField]) -> tuple[Array, int]:
    """(T, N) distances in px from the labels, and how many marks are nearer to another's label."""
    labels = _labels(data / "markers" / "mini" / "markers.csv")
    told = {number + LABELS_LAG: places for number, places in labels.items()}
    images = [number for number in sorted(told) if number < len(fields)]
    ids = KDTree(fields[images[0]].px).query(told[images[0]])[1]
    places = [fields[number].px[ids] for number in images]
    off_px = np.array([np.hypot(*(p - told[k]).T) for p, k in zip(places, images, strict=True)])
    nearest = [KDTree(told[k]).query(p)[1] for p, k in zip(places, images, strict=True)]
    return off_px, int(np.count_nonzero(np.array(nearest) != np.arange(len(ids))))


def mini(data: Path) -> None:
    """Print how far marks are from their labels, and what thinned detections do to them."""
    fields = followed(data / MINI, MINI_SIZE)
    off_px, swapped = against_labels(data, fields)
    kept = through(fields).mean()
    print(
        f"mini: {off_px.mean():.3f} px mean, {np.percentile(off_px, 95):.3f} p95,"
        f" {kept:.1%} kept, {swapped} swapped"
    )
    places, seen = thinned(fields, 0.3, np.random.default_rng(0))
    full = np.array([field.px for field in fields])
    apart = np.hypot(*np.moveaxis(places - full, -1, 0))
    pitch_px = np.median(KDTree(full[0]).query(full[0], k=2)[0][:, 1])
    print(
        f"mini, 30 % dropped: {(apart[seen] > pitch_px / 2).sum()} swapped, inferred"
        f" {np.percentile(apart[~seen], 95):.3f} px p95"
    )


def thinned(
    fields: list[MarkerField], missing: float, rng: np.random.Generator
) -> tuple[Array, NDArray[np.bool_]]:
    """Follow what is left of the marks of each frame: (T, N, 2) places, (T, N) whether seen."""
    tracker = MarkTracker(fields[0].px)
    places, seen = [], []
    for field in fields:
        tracker.follow(field.px[rng.random(len(field.px)) >= missing])
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


if __name__ == "__main__":
    main()
