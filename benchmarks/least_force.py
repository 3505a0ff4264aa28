"""The least force of a virtual sensor: ``python benchmarks/least_force.py PROFILE [--seed N]``.

Printed are, for every number that means a force, the noise at rest, the slope near zero, and the
smallest force from which on all readings differ from rest by more than 99 % of those at rest.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence

import numpy as np

from tactile_core.acquisition.acquisition import average
from tactile_core.calibration.virtual_unit import calibrate_virtual_unit
from tactile_core.cli.output import table_lines
from tactile_core.interfaces.sink import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import RelativeLoad, Wrench
from tactile_sim.stage import VirtualStage

REST_QUANTILE = 0.99  # share of the readings at rest: one false alarm in a hundred frames
NEAR_ZERO_N = 0.5  # the slope is fitted up to ten times the least force of the review's table 1
REST_FRAMES = 60  # count; the quantile is then close to the largest of them
HELD_N = 1.0  # normal force under shear: a light grip
SHEAR_MM = 0.004  # step of the object: less than a hundredth of a newton on the fingertip
SHEARS = 25  # count, to two tenths of a newton on the fingertip
FORCES_N = (0.01, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
OBJECTS: dict[str, tuple[str, dict[str, float]]] = {
    "sphere 12 mm": ("sphere", {"diameter_mm": 12}),
    "cylinder 10 mm": ("cylinder", {"diameter_mm": 10, "length_mm": 8}),
    "flat 6 mm": ("flat", {"diameter_mm": 6}),
}

Estimates = dict[str, float]


def estimates(reading: Reading) -> Estimates:
    """Return the numbers of a reading that mean a force, by name."""
    found: Estimates = {}
    load, wrench = reading.get(RelativeLoad), reading.get(Wrench)
    if load is not None:
        found["load"] = load.load
    if wrench is not None:
        found |= {"fx": wrench.fx_n, "fy": wrench.fy_n, "fz": wrench.fz_n}
    return found


class Trial:
    """A virtual sensor and its pipeline."""

    def __init__(self, profile: Profile, seed: int) -> None:
        self._stage = VirtualStage(profile, seed)
        needs_bundle = Wrench in Pipeline(profile).gives
        bundle = calibrate_virtual_unit(profile) if needs_bundle else None
        undeformed = average([self._stage.frame() for _ in range(10)])
        self._pipeline = Pipeline(profile, bundle, undeformed)

    def place(self, kind: str, sizes: dict[str, float]) -> None:
        """Take another object, above the undeformed surface."""
        self._stage.reset()
        self._pipeline.reset()
        self._stage.indenter(kind, **sizes)
        self.readings(1)

    def readings(self, count: int) -> list[Estimates]:
        """Return the estimates of so many frames."""
        return [estimates(self._pipeline.process(self._stage.frame())) for _ in range(count)]

    def press(self, force_n: float) -> tuple[Estimates, Estimates]:
        """Press with a force; return true forces and estimates."""
        self._stage.press(force_n=force_n)
        return self._true(), self.readings(1)[0]

    def shear(self, key: str) -> Iterator[tuple[Estimates, Estimates]]:
        """Shear step by step along the axis of this estimate."""
        for _ in range(SHEARS):
            self._stage.shear(dx_mm=SHEAR_MM * (key == "fx"), dy_mm=SHEAR_MM * (key == "fy"))
            yield self._true(), self.readings(1)[0]

    def _true(self) -> Estimates:
        fx, fy, fz, _ = map(float, self._stage.truth().wrench)
        return {"fx": fx, "fy": fy, "fz": fz}


def least_force(
    rest: Sequence[float], forces_n: Sequence[float], readings: Sequence[float]
) -> tuple[float | None, float, float]:
    """Return the least force in N, the noise at rest, and the reading per newton near zero."""
    calm, forces, found = (np.asarray(given) for given in (rest, forces_n, readings))
    off = found - calm.mean()
    limit = np.quantile(np.abs(calm - calm.mean()), REST_QUANTILE)
    order = np.argsort(np.abs(forces))
    missed = np.flatnonzero(np.abs(off[order]) <= limit)
    first = int(missed[-1]) + 1 if len(missed) else 0
    least = float(np.abs(forces[order[first]])) if first < len(order) else None
    near = np.abs(forces) <= NEAR_ZERO_N
    slope = np.sum(forces[near] * off[near]) / np.sum(forces[near] ** 2)
    return least, float(calm.std()), float(slope)


def rows(trial: Trial) -> Iterator[list[str]]:
    """Press and shear each object, and yield the lines of the table."""
    rest = trial.readings(REST_FRAMES)
    for name, (kind, sizes) in OBJECTS.items():
        trial.place(kind, sizes)
        pressed = [trial.press(force_n) for force_n in FORCES_N]
        for key in (key for key in rest[0] if key not in ("fx", "fy")):
            forces_n = [true["fz"] for true, _ in pressed]
            readings = [one[key] for _, one in pressed]
            yield [key, name, *_texts(least_force([one[key] for one in rest], forces_n, readings))]
        for key in ("fx", "fy") if "fx" in rest[0] else ():
            trial.place(kind, sizes)
            trial.press(HELD_N)
            calm = [one[key] for one in trial.readings(REST_FRAMES // 2)]
            sheared = list(trial.shear(key))
            forces_n, readings = ([one[key] for one in side] for side in zip(*sheared, strict=True))
            yield [key, name, *_texts(least_force(calm, forces_n, readings))]


def _texts(found: tuple[float | None, float, float]) -> list[str]:
    least, noise, slope = found
    return ["none" if least is None else f"{least:.3f} N", f"{noise:.2g}", f"{slope:.3g}"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("profile")
    parser.add_argument("--seed", type=int, default=0, help="of the unit and of its noise")
    given = parser.parse_args()
    trial = Trial(load_profile(given.profile, sim=True), given.seed)
    header = ["estimate", "object", "least force", "noise at rest", "per newton"]
    print("\n".join(table_lines(header, list(rows(trial)))))


if __name__ == "__main__":
    main()
