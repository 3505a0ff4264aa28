"""Slip of objects that no parameter saw: ``python benchmarks/slip_lift_folds.py [DATA]``.

Each object's lifts are scored with ``change_per_mm`` and ``imprint_changed`` chosen on the lifts of
the other objects: the values that leave the widest gap between those that slip and those that hold.
The control is the weakness of the first imprint. ``--step`` keeps every N-th frame.
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
from tactile_core.algorithms.slip.fusion import imprint_evidence
from tactile_core.algorithms.slip.imprint_tracker import ImprintTracker
from tactile_core.conditioning.marker_mask import MarkerFinder
from tactile_core.quantities import ShearRelease

ROOT = Path(__file__).resolve().parents[1]
PROFILE = "hex_fingertip"
TRIED = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0)
"""Values of ``change_per_mm``."""

FLOOR = 0.01
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
                    found = MarkerFinder.of(sensor.profile)
                    assert found is not None
                    given = pixels, markers.px, found.diameter_px, markers.mm_per_px
                    trackers = [ImprintTracker(*given, change_per_mm=k) for k in TRIED]
                released = reading[ShearRelease].released
                changes = [t.update(pixels, markers.px, markers.timestamp_s) for t in trackers]
                weakness = weakness or -changes[0].strength
                row_of = [imprint_evidence(c.changed, 0.0, released, 1.0) for c in changes]
                evidence.append(row_of if number > LIFT_FRAME else [0.0] * len(TRIED))
        slipped = row["label_stable1_slip0"] == "0"
        yield Lift(row["object"], slipped, np.array(evidence).T, weakness)


def chosen(slipped: NDArray[np.bool_], evidence: Array) -> tuple[int, float]:
    """Return the value with the widest gap, and the middle of that gap.

    Parameters
    ----------
    slipped : (n,)
    evidence : (n, values)
        Largest evidence of each lift.
    """
    held = np.maximum(evidence[~slipped].max(axis=0), FLOOR)
    lost = np.maximum(evidence[slipped].min(axis=0), FLOOR)
    best = int(np.argmax(lost / held))
    return best, float(np.sqrt(lost[best] * held[best]))


def main() -> None:
    """Print the score of each object by the others, and the values from all objects."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="?", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--step", type=int, default=1)
    given = parser.parse_args()
    found = list(lifts(given.data / "slip" / "grasp_lift", given.step))
    objects = np.array([lift.object for lift in found])
    slipped = np.array([lift.slipped for lift in found])
    series = np.maximum.accumulate(np.array([lift.evidence for lift in found]), axis=2)
    largest = series[..., -1]
    scores, early = np.zeros(len(found)), np.zeros(len(found))
    for name in sorted(set(objects)):
        here = objects == name
        value, limit = chosen(slipped[~here], largest[~here])
        scores[here] = largest[here, value] / limit
        early[here] = series[here, value, (10 - LIFT_FRAME % given.step) // given.step] / limit
        alarm = scores >= 1
        print(
            f"{name}: change_per_mm {TRIED[value]}, imprint_changed {limit:.3f}; "
            f"slips found {(alarm & slipped)[here].sum()} of {slipped[here].sum()}, "
            f"false {(alarm & ~slipped)[here].sum()} of {(~slipped)[here].sum()}"
        )
    alarm = scores >= 1
    print(
        f"all: found {(alarm & slipped).sum()} of {slipped.sum()}, "
        f"false {(alarm & ~slipped).sum()} of {(~slipped).sum()}"
    )
    weakness = np.array([lift.weakness for lift in found])
    for title, ranks in (("end", scores), ("frame 10", early), ("control", weakness)):
        print(
            f"{title}: AUC {area(slipped, ranks):.3f}, "
            f"within objects {area_within(slipped, ranks, objects):.3f}"
        )
    value, limit = chosen(slipped, largest)
    gaps = largest[slipped].min(axis=0) / largest[~slipped].max(axis=0)
    print(
        "gap by change_per_mm:",
        {k: round(float(gap), 2) for k, gap in zip(TRIED, gaps, strict=True)},
    )
    print(f"from all objects: change_per_mm {TRIED[value]}, imprint_changed {limit:.3f}")


if __name__ == "__main__":
    main()
