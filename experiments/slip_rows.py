"""Accuracy of slip detection by the whole chain: lifts by one finger, grasps by two."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments import slip_trials
from experiments.slip_trials import LIFT_FRAME, Trial, area, area_within
from experiments.table_row import Row, command

Bools = NDArray[np.bool_]

GRIPPER = Path(__file__).resolve().parent / "profiles" / "gripper_finger.yaml"


def lifts(data: Path) -> list[Row]:
    """Slip detection in every lift by the whole chain."""
    trials = slip_trials.lifts(data / "slip" / "grasp_lift", "hex_fingertip")
    slipped: Bools = np.array([trial.slipped for trial in trials], bool)
    objects = np.array([trial.object for trial in trials])
    degrees = np.array([trial.degrees for trial in trials])
    alarms = np.array([trial.alarms for trial in trials])
    weakness = np.array([trial.weakness for trial in trials])
    reported: Bools = np.asarray(alarms.any(axis=1), bool)
    early = alarms[:, : LIFT_FRAME + 1].any(axis=1)
    first = alarms.argmax(axis=1)[reported & slipped]
    what = (
        "slip/grasp_lift: a hexagonal fingertip with markers, not calibrated, 640 × 480; "
        f"{len(set(objects.tolist()))} objects"
    )
    how_many = f"{len(trials)} lifts, {slipped.sum()} of them slips"
    sample = (
        "the chain sees no label, but two parameters of the imprint were chosen on these lifts: in "
        "sample; benchmarks/slip_lift_folds.py scores each object by the others"
    )
    largest = np.maximum.accumulate(degrees, axis=1)
    end = largest[:, -1]
    return [
        Row(
            "slip_lifts_found",
            "slips reported, %",
            what,
            how_many,
            sample,
            _found(slipped, reported, objects),
            float(100 * reported[slipped].mean()),
            {
                "strength of the first imprint, without a false alarm": _without_false(
                    slipped, weakness
                )
            },
            command("slip_lifts"),
            {
                "false alarms on held lifts, %": float(100 * reported[~slipped].mean()),
                "reported before the lift": float(early.sum()),
                "slips": float(slipped.sum()),
                "slips reported": float(reported[slipped].sum()),
                "frames before the end, median": float(degrees.shape[1] - 1 - np.median(first)),
            },
        ),
        Row(
            "slip_lifts_area",
            "area under the curve of the largest degree",
            what,
            how_many,
            sample,
            {"all": area(slipped, end), "within objects": area_within(slipped, end, objects)},
            min(area(slipped, end), area_within(slipped, end, objects)),
            {
                "strength of the first imprint": area(slipped, weakness),
                "the same within objects": area_within(slipped, weakness, objects),
                "degree before the lift": area(slipped, largest[:, LIFT_FRAME]),
            },
            command("slip_lifts"),
            {f"frame {frame}": area(slipped, largest[:, frame]) for frame in (9, 10)},
        ),
    ]


def gripper(data: Path, every: int = 1) -> list[Row]:
    """Slip detection in every grasp of a pair of fingers by the whole chain."""
    pairs = slip_trials.grasps(data / "slip" / "gripper_pair", str(GRIPPER), every)
    slipped: Bools = np.array([pair[0].slipped for pair in pairs], bool)
    objects = np.array([pair[0].object for pair in pairs])
    degrees = _by_finger(pairs, lambda trial: float(trial.degrees.max()))
    reported: Bools = _by_finger(pairs, lambda trial: float(trial.alarms.any())).max(axis=1) > 0
    weakness = _by_finger(pairs, lambda trial: trial.weakness).max(axis=1)
    frames = _by_finger(pairs, lambda trial: float(trial.alarms.mean())).max(axis=1)
    areas = {"larger of both fingers": degrees.max(axis=1), "mean of both": degrees.mean(axis=1)}
    values = {name: area(slipped, scores) for name, scores in areas.items()}
    intervals = {
        name: slip_trials.interval(slipped, scores, objects) for name, scores in areas.items()
    }
    window = slip_trials.WINDOW
    name = "slip_gripper" if every == 1 else "slip_gripper_fourth"
    taken = "" if every == 1 else ", every fourth of them, replayed at 30 Hz"
    return [
        Row(
            f"{name}_area",
            "area under the curve of the largest degree",
            "slip/gripper_pair: two GelSight Minis on a gripper, not calibrated, 320 × 240; "
            f"{len(set(objects.tolist()))} objects",
            f"{len(pairs)} grasps of at least {window.stop} frames, {slipped.sum()} of them slips, "
            f"frames {window.start} to {window.stop}{taken}",
            "the chain sees no label; the method was chosen on these recordings: "
            "experiments/slip_contact_loss.py scores each object with levels from the others",
            values,
            min(values.values()),
            {
                "strength of the first imprint": area(slipped, weakness),
                "the same within objects": area_within(slipped, weakness, objects),
            },
            command(name),
            {
                f"{which}, within objects": area_within(slipped, scores, objects)
                for which, scores in areas.items()
            }
            | {
                f"{which}, 95 % {end}": value
                for which, ends in intervals.items()
                for end, value in zip(("from", "to"), ends, strict=True)
            }
            | {
                "slips reported, %": float(100 * reported[slipped].mean()),
                "false alarms on held grasps, %": float(100 * reported[~slipped].mean()),
                "frames of held grasps called slip, %": float(100 * frames[~slipped].mean()),
            },
        )
    ]


def _by_finger(pairs: list[list[Trial]], of: Callable[[Trial], float]) -> NDArray[np.float64]:
    return np.array([[of(trial) for trial in pair] for pair in pairs])


def _found(slipped: Bools, reported: Bools, objects: NDArray[np.str_]) -> dict[str, float]:
    return {
        name: float(100 * reported[slipped & (objects == name)].mean())
        for name in sorted(set(objects.tolist()))
    }


def _without_false(slipped: Bools, weakness: NDArray[np.float64]) -> float:
    """Slips, in %, whose imprint is weaker than in every hold: an oracle threshold."""
    return float(100 * (weakness[slipped] > weakness[~slipped].max()).mean())
