"""Coefficient of friction and margin to slip: ``python -m experiments.friction``.

Objects are pressed on virtual units and sheared until they slip; the whole chain measures rendered
images. Prints the error of the coefficient that ``core.friction`` measures in slip, for a profile
that assumes another one, and the error of the margin while the object sticks, for a profile that
knows the coefficient.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import numpy as np

from experiments.virtual_unit import VirtualUnit
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Friction, SlipState
from tactile_sim.stage import VirtualStage

SHAPES: tuple[tuple[str, dict[str, float], float], ...] = (
    ("sphere", {"diameter_mm": 12}, 0.4),
    ("sphere", {"diameter_mm": 30}, 0.4),
    ("cylinder", {"diameter_mm": 20, "length_mm": 10}, 0.3),
    ("flat", {"diameter_mm": 7}, 0.2),
    ("sphere", {"diameter_mm": 8}, 0.4),
    ("sphere", {"diameter_mm": 20}, 0.4),
    ("flat", {"diameter_mm": 12}, 0.2),
)
"""Kind, sizes and greatest depth in mm."""

STEP_MM, MOST_STEPS, AFTER = 0.06, 30, 4
"""Motion per frame, most frames, and frames after the object has begun to slip."""
ASSUMED = 0.5
"""Coefficient that the profile assumes."""


class Trial(NamedTuple):
    """One object: the true and the measured coefficient, and errors of the margin in stick."""

    name: str
    true: float
    measured: float | None
    margin_errors: list[float]


def chain(unit: VirtualUnit, rig: str, friction: float) -> Pipeline:
    """Return the whole chain with force and friction."""
    steps = {"force": {"use": "core.force_elastic"}, "friction": {"use": "core.friction"}}
    overrides: dict[str, Any] = {"gel": {"friction": friction}, "estimators": steps}
    return Pipeline(load_profile(rig, sim=True, overrides=overrides), unit.pipeline.bundle)


def trials(rig: str, seed: int, true: float, share: float) -> list[Trial]:
    """Press and shear every shape on one unit of this friction, at a share of the depths."""
    unit = VirtualUnit(rig, seed, {})
    stage = VirtualStage(rig, seed, overrides={"gel": {"friction": true}})
    assuming, knowing = chain(unit, rig, ASSUMED), chain(unit, rig, true)
    rng, found = np.random.default_rng(seed), []
    for kind, sizes, depth_mm in SHAPES:
        stage.reset()
        for pipeline in (assuming, knowing):
            pipeline.reset()
            pipeline.process(stage.frame())
        stage.indenter(
            kind, x_mm=float(rng.uniform(-2, 2)), y_mm=float(rng.uniform(-1, 1)), **sizes
        )
        for _ in range(3):
            stage.press(depth_mm=depth_mm * share)
            assuming.process(stage.frame())
            knowing.process(stage.frame())
        way, slipped, errors, measured = rng.uniform(0, 2 * np.pi), 0, [], None
        for _ in range(MOST_STEPS):
            stage.shear(dx_mm=STEP_MM * float(np.cos(way)), dy_mm=STEP_MM * float(np.sin(way)))
            frame, truth = stage.frame(), stage.truth()
            fx, fy, fz, _ = truth.wrench
            known, assumed = knowing.process(frame), assuming.process(frame)
            margin = known[Friction].margin
            if known[SlipState].state in ("stick", "incipient") and margin is not None:
                errors.append(margin - float(np.hypot(fx, fy) / (true * fz)))
            slipped += assumed[SlipState].state == "slip"
            if slipped:
                measured = assumed[Friction].coefficient
            if slipped > AFTER:
                break
        found.append(Trial(f"{kind} {sizes['diameter_mm']}", true, measured, errors))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--share", type=float, default=1 / 3, help="of the greatest depths")
    given = parser.parse_args()
    print("object: coefficient, measured, its error; errors of the margin: mean, largest")
    errors, margins = [], []
    for seed in given.seeds:
        for true in (0.3, 0.45, 0.7):
            for trial in trials(given.rig, seed, true, given.share):
                missed = trial.measured is None
                error = float("nan") if missed else trial.measured / trial.true - 1
                errors.append(error)
                margins += trial.margin_errors
                row = np.array(trial.margin_errors or [np.nan])
                shown = "none" if missed else f"{trial.measured:.3f}, {100 * error:+.1f} %"
                print(
                    f"{trial.name}: {trial.true:g}, {shown}; {row.mean():+.3f}, "
                    f"{np.abs(row).max():.3f}",
                    flush=True,
                )
    size = np.abs(errors)
    print(
        f"{np.isfinite(size).sum()} of {len(size)} coefficients: error median "
        f"{100 * np.nanmedian(size):.1f} %, largest {100 * np.nanmax(size):.1f} %, within 10 %: "
        f"{(size <= 0.1).sum()}; margin: error median {np.median(np.abs(margins)):.3f}, within "
        f"0.1: {100 * np.mean(np.abs(margins) <= 0.1):.0f} % of {len(margins)}"
    )


if __name__ == "__main__":
    main()
