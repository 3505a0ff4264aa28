"""Slip on real recordings: ``python benchmarks/slip_recordings.py [DATA] [--only N]``.

Scores the degree of slip against the labels of ``slip/grasp_lift`` and ``slip/gripper_pair``, which
nothing else uses. The control is the weakness of the first imprint: a weak grasp often slips, so a
cue that only measures its strength would score well without any slip.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.slip_trials import (
    LIFT_FRAME,
    WINDOW,
    area,
    area_within,
    grasps,
    lifts,
)

ROOT = Path(__file__).resolve().parents[1]
GRIPPER = ROOT / "experiments" / "profiles" / "gripper_finger.yaml"


def main() -> None:
    """Print a table per set of recordings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--only", choices=["grasp_lift", "gripper_pair"])
    options = parser.parse_args()
    if options.only != "gripper_pair":
        grasp_lift(options.data / "slip" / "grasp_lift", "hex_fingertip")
    if options.only != "grasp_lift":
        gripper_pair(options.data / "slip" / "gripper_pair", str(GRIPPER))


def grasp_lift(folder: Path, profile: str) -> None:
    """Print the accuracy and lead time of slip detection, and false alarms before the lift."""
    trials = lifts(folder, profile)
    slipped = np.array([trial.slipped for trial in trials])
    objects = np.array([trial.object for trial in trials])
    degrees = np.array([trial.degrees for trial in trials])
    print(f"grasp_lift: {len(trials)} lifts, {slipped.sum()} slips")
    for name, scores in (
        ("degree", degrees),
        ("largest yet", np.maximum.accumulate(degrees, axis=1)),
    ):
        for frame in (LIFT_FRAME, 9, 10, degrees.shape[1] - 1):
            _print_areas(f"{name}, frame {frame}", slipped, scores[:, frame], objects)
    _print_areas("control", slipped, np.array([trial.weakness for trial in trials]), objects)
    alarms = np.array([trial.alarms for trial in trials])
    first = np.where(alarms.any(axis=1), alarms.argmax(axis=1), degrees.shape[1])
    for name in ["all", *sorted(set(objects))]:
        here = (objects == name) | (name == "all")
        of_slips = first[here & slipped]
        before_end = degrees.shape[1] - 1 - np.median(of_slips)
        print(
            f"  {name}: slips detected {(of_slips < degrees.shape[1]).sum()} of {of_slips.size},"
            f" false {(first[here & ~slipped] < degrees.shape[1]).sum()} of"
            f" {(here & ~slipped).sum()}, {before_end:.0f} frames before the end (median),"
            f" before the lift {(first[here] <= LIFT_FRAME).sum()}"
        )


def gripper_pair(folder: Path, profile: str) -> None:
    """Print the accuracy of slip detection by two fingers."""
    pairs = grasps(folder, profile)
    slipped = np.array([pair[0].slipped for pair in pairs])
    objects = np.array([pair[0].object for pair in pairs])
    print(f"gripper_pair, frames {WINDOW.start}-{WINDOW.stop}: {slipped.size} grasps,", end=" ")
    print(f"{slipped.sum()} slips")
    degrees = np.array([[trial.degrees.max() for trial in pair] for pair in pairs])
    weakness = np.array([[trial.weakness for trial in pair] for pair in pairs])
    _print_areas("larger of two fingers", slipped, degrees.max(axis=1), objects)
    _print_areas("mean of two fingers", slipped, degrees.mean(axis=1), objects)
    _print_areas("control", slipped, weakness.max(axis=1), objects)


def _print_areas(
    name: str,
    slipped: NDArray[np.bool_],
    scores: NDArray[np.float64],
    objects: NDArray[np.str_],
) -> None:
    within = area_within(slipped, scores, objects)
    print(f"  {name:24s} AUC {area(slipped, scores):.3f}, within objects {within:.3f}")


if __name__ == "__main__":
    main()
