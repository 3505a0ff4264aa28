"""Score the loss of contact on recorded grasps: nested, leave one object out.

The levels of strain and relief without contact are the lower quartiles of the smallest values of
the fingers that gripped other objects; no label is used. The control is the weakness of the first
contact. Run ``python -m experiments.slip_contact_loss DATA``.
"""

from __future__ import annotations

import argparse
import csv
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.slip_rows import GRIPPER
from experiments.slip_trials import WINDOW, area, area_within
from tactile_core import MarkerField, open_sensor
from tactile_core.algorithms.markers import find_marker_diameter
from tactile_core.algorithms.slip.contact_loss import (
    CONTACT_LOSS,
    ContactLossTracker,
    LossOfStrength,
    contact_strength,
)
from tactile_core.algorithms.slip.marker_lattice import MarkerLattice
from tactile_core.algorithms.slip.surface_view import SurfaceView
from tactile_core.recordings.recording import open_recording

FOURTH = 4
"""Interval of the frames that a slower camera would record."""
REPLAY_HZ = 30.0
"""Rate at which a folder of images is replayed, whatever the rate of its recording."""
_FREE_QUANTILE = 0.25
_RESAMPLES = 2000


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

    def losses(self, free: tuple[float, float], period_s: float) -> list[LossOfStrength]:
        """Loss of contact in the frames of the window."""
        tracker = ContactLossTracker()
        losses = []
        for number, (strain, relief) in enumerate(zip(self.strain, self.relief, strict=True)):
            strength = contact_strength(
                None if np.isnan(strain) else strain,
                relief,
                free_strain=free[0],
                free_relief=free[1],
            )
            losses.append(tracker.update(strength, number * period_s))
        scored = self.frames >= WINDOW.start
        return [loss for loss, counts in zip(losses, scored, strict=True) if counts]

    def least(self, rate_hz: float) -> tuple[float, float]:
        """Smallest strain and relief after the recording has begun."""
        begun = self.frames >= CONTACT_LOSS.settle_s * rate_hz
        return float(np.nanmin(self.strain[begun])), float(self.relief[begun].min())


@dataclass(frozen=True)
class Grasp:
    """Both fingers of one grasp."""

    object: str
    name: str
    slipped: bool
    rate_hz: float
    fingers: list[Finger]


def grasps(folder: Path, every: int) -> list[Grasp]:
    """Measure both fingers of every grasp in every frame, or in every fourth."""
    found: dict[tuple[str, str], Grasp] = {}
    with (folder / "labels.csv").open() as rows:
        labels = [row for row in csv.DictReader(rows) if int(row["n_frames"]) >= WINDOW.stop]
    for row in labels:
        key = row["object"], row["trial"]
        grasp = found.setdefault(key, Grasp(*key, row["slip"] == "1", float(row["fps"]), []))
        grasp.fingers.append(_finger(folder.joinpath(*key, row["video"]), every, grasp.rate_hz))
    return list(found.values())


def _finger(video: Path, every: int, rate_hz: float) -> Finger:
    numbers = np.arange(0, WINDOW.stop, every)
    if every == 1:
        return _measured(video, numbers, rate_hz)
    with TemporaryDirectory() as folder:
        for number, observation in enumerate(islice(open_recording(video), WINDOW.stop)):
            if number % every == 0:
                pixels = cv2.cvtColor(observation.images[0].pixels, cv2.COLOR_RGB2BGR)
                cv2.imwrite(str(Path(folder) / f"{number:04d}.png"), pixels)
        return _measured(Path(folder), numbers, rate_hz)


def _measured(source: Path, numbers: NDArray[np.int_], rate_hz: float) -> Finger:
    strains, reliefs = [], []
    lattice: MarkerLattice | None = None
    view: SurfaceView | None = None
    with open_sensor(str(GRIPPER), input=source, reference="first") as sensor:
        for number, reading in zip(numbers, sensor.stream(), strict=False):
            pixels, markers = reading.frame.pixels, reading[MarkerField]
            if lattice is None or view is None:
                size = find_marker_diameter(pixels)
                assert size is not None, source
                lattice = MarkerLattice(markers.px)
                view = SurfaceView(pixels, markers.px, size[0])
            strain = lattice.strain(markers.px, markers.seen, number / rate_hz)
            strains.append(np.nan if strain is None else strain)
            pattern, seen = view.imprint(pixels, markers.px)
            count = max(float(seen.sum()) * pattern.shape[2], 1.0)
            reliefs.append(float(np.sqrt(np.square(pattern).sum() / count)))
    return Finger(numbers[: len(strains)], np.array(strains), np.array(reliefs))


def outer(trials: list[Grasp], period_s: float) -> list[list[list[LossOfStrength]]]:
    """Losses of each finger of each grasp, with levels from the grasps of other objects."""
    return [
        [
            finger.losses(_free([t for t in trials if t.object != trial.object]), period_s)
            for finger in trial.fingers
        ]
        for trial in trials
    ]


def _free(trials: list[Grasp]) -> tuple[float, float]:
    least = np.array([finger.least(trial.rate_hz) for trial in trials for finger in trial.fingers])
    strain, relief = np.quantile(least, _FREE_QUANTILE, axis=0)
    return float(strain), float(relief)


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
    weakness = np.array([max(-finger.relief[1] for finger in trial.fingers) for trial in trials])
    print(title)
    print("  free strain and relief of the others:", np.round(_free(trials), 4))
    for name, score in (
        ("mean of both fingers", largest.mean(axis=1)),
        ("larger of both fingers", largest.max(axis=1)),
        ("control: weakness of the first contact", weakness),
    ):
        low, high = _interval(slipped, score, objects)
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
        f"{(unknown.min(axis=1) == 1)[~slipped].sum()} held grasps"
    )
    if table:
        for number in np.argsort(largest.mean(axis=1)):
            trial = trials[number]
            print(
                f"    {'slip' if trial.slipped else 'held'} {trial.object} {trial.name}: lost "
                f"{np.round(largest[number], 2)}, unknown {np.round(unknown[number], 2)}"
            )


def _interval(
    slipped: NDArray[np.bool_], score: NDArray[np.float64], objects: NDArray[np.str_]
) -> tuple[float, float]:
    """95 % interval of the area over objects, by resampling them."""
    names, random, areas = np.unique(objects), np.random.default_rng(0), []
    for _ in range(_RESAMPLES):
        drawn = random.choice(names, len(names))
        chosen = np.concatenate([np.flatnonzero(objects == name) for name in drawn])
        if 0 < slipped[chosen].sum() < len(chosen):
            areas.append(area(slipped[chosen], score[chosen]))
    low, high = np.quantile(areas, (0.025, 0.975))
    return float(low), float(high)


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
