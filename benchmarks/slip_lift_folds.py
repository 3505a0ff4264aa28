"""Slip of objects that no parameter saw: ``python benchmarks/slip_lift_folds.py [DATA]``.

For several values of ``change_per_mm``, each object's lifts are scored with the limit
``imprint_changed`` from the lifts of the other objects: the middle of the gap between those that
slip and those that hold. The control is the weakness of the first imprint. ``--step`` keeps every
N-th frame.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.slip_trials import LIFT_FRAME, area, area_within
from tactile_core import MarkerField, open_sensor
from tactile_core.algorithms.slip.imprint_tracker import ImprintTracker
from tactile_core.conditioning.marker_finder import MarkerFinder

ROOT = Path(__file__).resolve().parents[1]
PROFILE = "hex_fingertip"
TRIED = (0.4, 0.5, 0.6, 0.7)
"""Values of ``change_per_mm``."""

FLOOR = 0.005
"""Evidence that noise alone may give; smaller values of held lifts are no better."""

Array = NDArray[np.float64]


class Lift(NamedTuple):
    """Evidence of slip in one lift, for a limit of 1, by ``change_per_mm`` and frame."""

    object: str
    slipped: bool
    evidence: Array
    weakness: float


def lifts(folder: Path, step: int) -> Iterator[Lift]:
    """Measure every lift with every value."""
    with (folder / "labels.csv").open() as rows:
        labels = list(csv.DictReader(rows))
    for row in labels:
        source = folder / row["object"] / f"{row['trial_folder']}_mm"
        trackers: list[ImprintTracker] = []
        evidence: list[list[float]] = []
        weakness = 0.0
        with open_sensor(PROFILE, input=source, reference="first") as sensor:
            for number, reading in enumerate(sensor.stream()):
                if number % step != LIFT_FRAME % step:
                    continue
                pixels, markers = reading.frame.pixels, reading[MarkerField]
                if not trackers:
                    found = MarkerFinder.for_gel(sensor.profile)
                    assert found is not None
                    given = pixels, markers.px, found.diameter_px, markers.mm_per_px
                    trackers = [ImprintTracker(*given, change_per_mm=k) for k in TRIED]
                changes = [t.update(pixels, markers.px, markers.timestamp_s) for t in trackers]
                weakness = weakness or -changes[0].strength
                row_of = [c.changed for c in changes]
                evidence.append(row_of if number > LIFT_FRAME else [0.0] * len(TRIED))
        slipped = row["label_stable1_slip0"] == "0"
        yield Lift(row["object"], slipped, np.array(evidence).T, weakness)


def limit_between(slipped: NDArray[np.bool_], largest: Array) -> float:
    """Return the middle, in logarithms, of the gap between the lifts that slip and that hold."""
    held, lost = (max(float(x), FLOOR) for x in (largest[~slipped].max(), largest[slipped].min()))
    return float(np.sqrt(lost * held))


def scored(found: list[Lift], value: int, frame: int) -> None:
    """Print the score with one value of ``change_per_mm``; each limit is from other objects."""
    objects = np.array([lift.object for lift in found])
    slipped = np.array([lift.slipped for lift in found])
    series = np.maximum.accumulate(np.array([lift.evidence[value] for lift in found]), axis=1)
    largest = series[:, -1]
    limits = {
        name: limit_between(slipped[objects != name], largest[objects != name])
        for name in sorted(set(objects))
    }
    limit = np.array([limits[name] for name in objects])
    alarm, early = largest >= limit, series[:, frame] / limit
    print(
        f"change_per_mm {TRIED[value]}: found {(alarm & slipped).sum()} of {slipped.sum()}, "
        f"false {(alarm & ~slipped).sum()} of {(~slipped).sum()}; "
        f"AUC {area(slipped, largest / limit):.3f}, "
        f"within objects {area_within(slipped, largest, objects):.3f}, "
        f"at frame 10 {area(slipped, early):.3f}; "
        f"held at most {largest[~slipped].max():.3f}, "
        f"slipped at least {largest[slipped].min():.3f}, "
        f"limit from all {limit_between(slipped, largest):.3f}, from others "
        + ", ".join(f"{one:.3f}" for one in limits.values())
    )


def main() -> None:
    """Print the score for every value of ``change_per_mm``, and the control."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="?", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--step", type=int, default=1)
    given = parser.parse_args()
    found = list(lifts(given.data / "slip" / "grasp_lift", given.step))
    for value in range(len(TRIED)):
        scored(found, value, (10 - LIFT_FRAME % given.step) // given.step)
    slipped = np.array([lift.slipped for lift in found])
    weakness = np.array([lift.weakness for lift in found])
    print(f"control, weakness of the first imprint: AUC {area(slipped, weakness):.3f}")


if __name__ == "__main__":
    main()
