"""Score the loss of contact on recorded grasps: nested, leave one object out.

The levels of strain and relief without contact are the lower quartiles of the smallest values of
the fingers that gripped other objects; the uncertainty of a strength is its difference between both
fingers at their own levels. No label is used. The control is the weakness of the first contact. Run
``python -m experiments.slip_contact_loss DATA``; it takes five minutes on one core.
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.slip_rows import GRIPPER
from experiments.slip_trials import FOURTH, WINDOW, area, area_within, interval, taken
from tactile_core import MarkerField, open_sensor
from tactile_core.algorithms.slip.contact_loss import (
    CONTACT_LOSS,
    ContactLossTracker,
    LossOfStrength,
    contact_strength,
)
from tactile_core.algorithms.slip.marker_lattice import MarkerLattice
from tactile_core.quantities import ImprintMotion

CONTACT = GRIPPER.with_name("gripper_contact.yaml")
REPLAY_HZ = 30.0
"""Rate at which a folder of images is replayed, whatever the rate of its recording."""
_FREE_QUANTILE = 0.25


class Levels(NamedTuple):
    """Strain and relief of a gel without contact, and the uncertainty of a strength."""

    strain: float
    relief: float
    uncertainty: float


@dataclass(frozen=True)
class Finger:
    """One finger in one grasp.

    Attributes
    ----------
    frames, strain, relief : (T,)
        Number of each frame; strain of the marker lattice, NaN if unknown; strength of the imprint.
    """

    frames: NDArray[np.int_]
    strain: NDArray[np.float64]
    relief: NDArray[np.float64]

    def losses(self, free: Levels, period_s: float) -> list[LossOfStrength]:
        """Loss of contact in the frames of the window."""
        tracker = ContactLossTracker(free.uncertainty)
        losses = []
        for number, (strain, relief) in enumerate(zip(self.strain, self.relief, strict=True)):
            strength = contact_strength(
                None if np.isnan(strain) else strain,
                relief,
                free_strain=free.strain,
                free_relief=free.relief,
            )
            losses.append(tracker.update(strength, number * period_s))
        scored = self.frames >= WINDOW.start
        return [loss for loss, counts in zip(losses, scored, strict=True) if counts]

    def least(self, rate_hz: float) -> tuple[float, float]:
        """Smallest strain and relief after the recording has begun."""
        begun = self.frames >= CONTACT_LOSS.settle_s * rate_hz
        return float(np.nanmin(self.strain[begun])), float(self.relief[begun].min())

    @property
    def weakness(self) -> float:
        """Negative relief in the first scored frame."""
        return -float(self.relief[self.frames >= WINDOW.start][0])


@dataclass(frozen=True)
class Grasp:
    """Both fingers of one grasp."""

    object: str
    name: str
    slipped: bool
    rate_hz: float
    fingers: list[Finger] = field(default_factory=list)


def grasps(folder: Path, every: int) -> list[Grasp]:
    """Measure both fingers of every grasp in every frame, or in every fourth."""
    found: dict[tuple[str, str], Grasp] = {}
    with (folder / "labels.csv").open() as rows:
        labels = [row for row in csv.DictReader(rows) if int(row["n_frames"]) >= WINDOW.stop]
    for number, row in enumerate(labels):
        key = row["object"], row["trial"]
        grasp = found.setdefault(key, Grasp(*key, row["slip"] == "1", float(row["fps"])))
        grasp.fingers.append(_finger(folder.joinpath(*key, row["video"]), every, grasp.rate_hz))
        print(f"\r{number + 1} of {len(labels)} videos", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return list(found.values())


def _finger(video: Path, every: int, rate_hz: float) -> Finger:
    strains, reliefs = [], []
    lattice: MarkerLattice | None = None
    with (
        taken(video, every) as source,
        open_sensor(str(CONTACT), input=source, reference="first") as sensor,
    ):
        numbers = np.arange(0, WINDOW.stop, every)
        for number, reading in zip(numbers, sensor.stream(), strict=False):
            markers = reading[MarkerField]
            lattice = lattice or MarkerLattice(markers.px)
            strain = lattice.strain(markers.px, markers.seen, number / rate_hz)
            strains.append(np.nan if strain is None else strain)
            reliefs.append(reading[ImprintMotion].strength)
    return Finger(numbers[: len(strains)], np.array(strains), np.array(reliefs))


def outer(trials: list[Grasp], period_s: float) -> list[list[list[LossOfStrength]]]:
    """Losses of each finger of each grasp, with levels from the grasps of other objects."""
    levels = {
        name: _free([trial for trial in trials if trial.object != name])
        for name in {trial.object for trial in trials}
    }
    return [
        [finger.losses(levels[trial.object], period_s) for finger in trial.fingers]
        for trial in trials
    ]


def _free(trials: list[Grasp]) -> Levels:
    least = np.array([[f.least(trial.rate_hz) for f in trial.fingers] for trial in trials])
    both = np.quantile(least.reshape(-1, 2), _FREE_QUANTILE, axis=0)
    squares = np.square(np.quantile(least, _FREE_QUANTILE, axis=0) / both).sum(axis=1)
    return Levels(float(both[0]), float(both[1]), float(np.ptp(squares)))


def report(trials: list[Grasp], period_s: float, title: str, *, table: bool = False) -> None:
    """Print areas, their 95 % intervals over objects, false alarms and unknown shares."""
    slipped = np.array([trial.slipped for trial in trials])
    objects = np.array([trial.object for trial in trials])
    losses = outer(trials, period_s)
    largest = np.array([[max(x.lost for x in finger) for finger in pair] for pair in losses])
    alarms = np.array([[np.mean([x.slips for x in finger]) for finger in pair] for pair in losses])
    unknown = np.array(
        [[np.mean([not x.known for x in finger]) for finger in pair] for pair in losses]
    )
    weakness = np.array([max(finger.weakness for finger in trial.fingers) for trial in trials])
    print(title)
    print("  free strain and relief, uncertainty, of all:", np.round(_free(trials), 4))
    for name, score in (
        ("mean of both fingers", largest.mean(axis=1)),
        ("larger of both fingers", largest.max(axis=1)),
        ("control: weakness of the first contact", weakness),
    ):
        low, high = interval(slipped, score, objects)
        within = area_within(slipped, score, objects)
        print(
            f"  {name}: area {area(slipped, score):.3f} ({low:.3f} to {high:.3f}), "
            f"within objects {within:.3f}"
        )
    frames, reported = 100 * alarms.max(axis=1), alarms.max(axis=1) > 0
    print(
        f"  called slip: {frames[~slipped].mean():.2f} % of the frames of held grasps, "
        f"{100 * reported[~slipped].mean():.0f} % of held grasps, "
        f"{100 * reported[slipped].mean():.0f} % of slips"
    )
    share = 100 * unknown.mean(axis=1)
    print(
        f"  unknown: {share[slipped].mean():.0f} % of the frames of slips, "
        f"{share[~slipped].mean():.0f} % of those of held grasps; never known on either finger: "
        f"{(unknown.min(axis=1) == 1)[slipped].sum()} slips, "
        f"{(unknown.min(axis=1) == 1)[~slipped].sum()} held grasps",
        flush=True,
    )
    if table:
        for number in np.argsort(largest.mean(axis=1)):
            trial = trials[number]
            print(
                f"    {'slip' if trial.slipped else 'held'} {trial.object} {trial.name}: lost "
                f"{np.round(largest[number], 2)}, unknown {np.round(unknown[number], 2)}"
            )


def main() -> None:
    """Print the scores for every frame, and for every fourth with the right and a wrong clock."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--table", action="store_true", help="print every grasp")
    chosen = parser.parse_args()
    folder = chosen.data / "slip" / "gripper_pair"
    trials = grasps(folder, 1)
    rate_hz = trials[0].rate_hz
    report(trials, 1 / rate_hz, "every frame", table=chosen.table)
    trials = grasps(folder, FOURTH)
    report(trials, FOURTH / rate_hz, "every fourth frame", table=chosen.table)
    report(trials, 1 / REPLAY_HZ, f"every fourth frame, replayed at {REPLAY_HZ:g} Hz")


if __name__ == "__main__":
    main()
