"""Marker tracking: ``python benchmarks/marker_tracking.py [DATA] [--frames N] [--seed S]``.

On recordings, ``core.markers`` detects markers and ``core.marker_tracking`` tracks them from the
first frame on; the labels of ``markers/mini`` come from another tracker. On virtual sequences,
markers of a sheared gel surface are tracked while a third of them is undetected and spurious
detections are added.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from experiments.marker_recordings import (
    IRREGULAR,
    IRREGULAR_SIZE,
    LIFT_SIZE,
    LIFTS,
    MINI,
    MINI_SIZE,
    UNDEFORMED,
    UNDEFORMED_SIZE,
    against_labels,
    followed,
    read,
    thinned,
    through,
)
from experiments.sheared_markers import Shear, counted
from tactile_core import MarkerDetections

ROOT = Path(__file__).resolve().parents[1]

SHEARS = {
    "to 1 pitch, 0.35 a frame": Shear(1.0, 0.35, spurious=0.05),
    "to 2 pitches, 0.35 a frame": Shear(2.0, 0.35, spurious=0.02),
    "to 2 pitches, 0.35 a frame, nothing spurious": Shear(2.0, 0.35, spurious=0.0),
    "to 2 pitches, 0.7 a frame": Shear(2.0, 0.7, spurious=0.05),
}


def main() -> None:
    """Print a line per recording and per virtual shear sequence."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--frames", type=int, default=1000, help="frames per virtual row")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first virtual stroke")
    options = parser.parse_args()
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
        count = len(
            read(options.data / UNDEFORMED, UNDEFORMED_SIZE)[0][MarkerDetections].centres_px
        )
        print(f"hex_fingertip/frame0: {count} detected (90 expected, of them 3-4 spurious)")
    for name, shear in SHEARS.items():
        print(f"virtual, {name}: {counted(shear, options.frames, options.seed)}")


def mini(data: Path) -> None:
    """Print the error against the labels, and the effect of missing detections."""
    fields = followed(data / MINI, MINI_SIZE)
    off_px, swapped = against_labels(data, fields)
    kept = through(fields).mean()
    print(
        f"mini: {off_px.mean():.3f} px mean, {np.percentile(off_px, 95):.3f} p95,"
        f" {kept:.1%} kept, {swapped} swapped"
    )
    places, seen = thinned(fields, 0.3, np.random.default_rng(0))
    full = np.array([field.px for field in fields])
    error_px = np.hypot(*np.moveaxis(places - full, -1, 0))
    pitch_px = np.median(KDTree(full[0]).query(full[0], k=2)[0][:, 1])
    print(
        f"mini, 30 % dropped: {(error_px[seen] > pitch_px / 2).sum()} swapped, inferred"
        f" {np.percentile(error_px[~seen], 95):.3f} px p95"
    )


if __name__ == "__main__":
    main()
