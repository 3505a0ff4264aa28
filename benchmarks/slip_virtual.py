"""Slip from rendered frames: ``python benchmarks/slip_virtual.py [--sequences N] [--seed S]``.

Presses unseen virtual objects on ``hex_fingertip`` and shears or twists them until they slip.
Measures every frame by the profile's whole chain, and compares degree and state with the true stick
share of the contact: once with a calibration from virtual ball presses, and once without. Half of
the sequences are quasi-static, half at 0.03 to 1 mm/s.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from slip_thresholds import QUICK_MM_S, auc
from virtual_calibration import Draw, command, simulated

from experiments.slip_sequences import GROSS, HALF, Judged, Plan, plans
from tactile_core import Pipeline, load_profile
from tactile_core.bundles.bundle import Bundle
from tactile_core.quantities import Frame, Reference, SlipState
from tactile_sim import VirtualStage

PROFILE = "hex_fingertip"
UNIT = 0
"""Seed of the virtual unit, for calibration and measurement."""

TURNS, PRESSES = 3, 14
"""Every third object is twisted; number of calibration presses."""

_MOST_STEPS, _AFTER_GROSS, _LEVER_MM = 60, 8, 4.0
"""Frames at most, frames after gross slip, and the lever in mm that turns twist into speed."""


@dataclass(frozen=True, eq=False)
class Shot:
    """A rendered frame and its ground truth.

    Attributes
    ----------
    frame : Frame
    moving : bool
        False during the press.
    stick_share : float
        Sticking share of the visible contact.
    """

    frame: Frame
    moving: bool
    stick_share: float


def shots(plan: Plan) -> Iterator[Shot]:
    """Take frames of the undeformed surface, of a press, and of shear until after gross slip."""
    stage = VirtualStage(PROFILE, UNIT, overrides={"gel": {"friction": plan.friction}})
    yield Shot(stage.frame(), False, 1.0)
    x, y = plan.place_mm
    stage.indenter(plan.shape, x_mm=x, y_mm=y, angle_deg=plan.angle_deg, **plan.options)
    for share in np.arange(1, plan.press_frames + 1) / plan.press_frames:
        stage.press(depth_mm=share * plan.depth_mm)
        yield _shot(stage, moving=False)
    travel_mm = np.radians(abs(plan.step)) * _LEVER_MM if plan.turned else plan.step
    seconds = None if plan.speed_mm_s is None else travel_mm / plan.speed_mm_s
    slipped = 0
    for _ in range(_MOST_STEPS):
        if plan.turned:
            stage.twist(plan.step, seconds=seconds)
        else:
            along, down = np.cos(plan.direction_rad), np.sin(plan.direction_rad)
            stage.shear(plan.step * along, plan.step * down, seconds=seconds)
        shot = _shot(stage, moving=True)
        yield shot
        slipped += shot.stick_share < GROSS
        if slipped > _AFTER_GROSS:
            return


def _shot(stage: VirtualStage, *, moving: bool) -> Shot:
    truth = stage.truth()
    touched = int(truth.contact.sum())
    share = float(truth.stick.sum()) / touched if touched else 1.0
    return Shot(stage.frame(), moving, share)


def undeformed(frame: Frame) -> Reference:
    """Make a reference from one frame."""
    return Reference(frame.pixels.astype(np.float32), frame.channels, frame.full_scale)


def measured(plan: Plan, bundles: Sequence[Path | None]) -> list[Judged]:
    """Measure one sequence with each of several bundles; None measures without a bundle."""
    taken = shots(plan)
    reference = undeformed(next(taken).frame)
    loaded = [None if folder is None else Bundle.load(folder) for folder in bundles]
    pipelines = [Pipeline(PROFILE, bundle, reference) for bundle in loaded]
    shares: list[float] = []
    states: list[list[SlipState]] = [[] for _ in bundles]
    for shot in taken:
        slips = [pipeline.process(shot.frame)[SlipState] for pipeline in pipelines]
        if shot.moving:
            shares.append(shot.stick_share)
            for collected, slip in zip(states, slips, strict=True):
                collected.append(slip)
    return [Judged(plan, np.array(shares), tuple(collected)) for collected in states]


def drawn(count: int, seed: int) -> list[Plan]:
    """Draw objects at random; one is twisted for every two that are sheared."""
    turned = count // TURNS
    return plans(count - turned, seed, turned=False) + plans(turned, seed, turned=True)


def calibrated(folder: Path) -> Path:
    """Calibrate the unit on ball presses."""
    draw, out = Draw(load_profile(PROFILE), UNIT), folder / "presses"
    simulated(PROFILE, draw.calibrating(PRESSES), out, UNIT)
    command(
        *("calibrate", PROFILE, "--presses", str(out / "frames")),
        *("--reference", str(out / "reference"), "--ball-diameter-mm", str(draw.ball_mm)),
        *("--out", str(folder / "bundle")),
    )
    return folder / "bundle"


def row(name: str, sequences: Sequence[Judged]) -> str:
    """Score some sequences."""
    stick = np.concatenate([one.stick_share for one in sequences])
    degree = np.concatenate([one.degree for one in sequences])
    held = np.concatenate([one.alarm for one in sequences])[stick >= HALF]
    ends = [(one.alarm, int(np.argmax(one.gross))) for one in sequences if one.gross.any()]
    warned = [bool(alarm[:end].any()) for alarm, end in ends if end]
    areas = auc(degree, stick < HALF), auc(degree, stick < GROSS)
    return (
        f"{name:24}{len(sequences):4}{areas[0]:10.4f}{areas[1]:9.4f}"
        f"{held.sum():6} of {held.size:<5}{100 * held.mean() if held.size else 0:5.1f} %"
        f"{sum(warned):5} of {len(warned)}"
    )


def report(sequences: Sequence[Judged]) -> None:
    """Print a table."""
    print(f"{'':24} seq incipient    gross   false alarms         warned")
    turned = [one for one in sequences if one.plan.turned]
    groups = {"all": list(sequences)}
    for verb, some in (
        ("sheared", [s for s in sequences if not s.plan.turned]),
        ("twisted", turned),
    ):
        groups[verb] = some
        groups[f"{verb}, border in view"] = [s for s in some if s.plan.kind != "plate"]
        groups[f"{verb}, quasi-static"] = [s for s in some if s.plan.speed_mm_s is None]
        groups[f"{verb}, to {QUICK_MM_S} mm/s"] = [
            s for s in some if 0 < (s.plan.speed_mm_s or 0) < QUICK_MM_S
        ]
        groups[f"{verb}, {QUICK_MM_S} to 1 mm/s"] = [
            s for s in some if (s.plan.speed_mm_s or 0) >= QUICK_MM_S
        ]
    for kind in dict.fromkeys(one.plan.kind for one in sequences):
        groups[kind] = [s for s in sequences if s.plan.kind == kind]
    for name, some in groups.items():
        if some:
            print(row(name, some))
    kinds = [state.kind == "rotation" for one in turned for state in one.states if state.kind]
    if kinds:
        print(
            f"slip of twisted objects classified as rotation in {100 * np.mean(kinds):.1f} % of "
            f"frames"
        )


def main() -> None:
    """Print one table with a calibration and one without."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequences", type=int, default=36)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args()
    wanted = drawn(given.sequences, given.seed)
    with TemporaryDirectory(prefix="slip-virtual-") as name:
        bundles = [calibrated(Path(name)), None]
        with ProcessPoolExecutor(given.processes) as pool:
            found = list(pool.map(partial(measured, bundles=bundles), wanted))
    for number, title in enumerate(("calibrated", "no calibration")):
        print(f"\n{title}")
        report([judged[number] for judged in found])


if __name__ == "__main__":
    main()
