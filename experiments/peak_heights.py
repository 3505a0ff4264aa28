"""Peak height of virtual objects on every rig: ``python experiments/peak_heights.py``.

Each unit is calibrated by ball presses with the profile's defaults, and presses balls, cylinders,
round flat ends and cones that no calibration has seen. Prints the measured peak over the true one
for each rig, object and unit, and the same with true slopes in place of measured ones. An object
whose peak the smoothing of the calibration lowers by more than 2 %, such as a cone's tip, is marked
by * and not counted. With ``--believed 1.2`` the profiles say that the gel is 20 % thicker than it
is.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.table_row import Row, command
from experiments.virtual_unit import Pressed, VirtualUnit, unit_overrides
from tactile_core.builtin.poisson import Poisson
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.quantities import Gradients
from tactile_sim.demonstration import is_resolved

SHIPPED = ("baxter_fingertip", "desktop_six_led", "desktop_three_colour", "hex_fingertip")


@dataclass(frozen=True)
class Peak:
    """Measured over true peak of one press."""

    rig: str
    label: str
    seed: int
    ratio: float
    of_true_slopes: float
    is_resolved: bool


def objects(rng: np.random.Generator) -> Iterator[Pressed]:
    """One press of each object, at random places within the calibrated area."""
    for label, kind, sizes, depth in (
        ("ball 1.5", "sphere", {"diameter_mm": 1.5}, 0.13),
        ("ball 0.7", "sphere", {"diameter_mm": 0.7}, 0.11),
        ("cylinder", "cylinder", {"diameter_mm": 1.2, "length_mm": 1.6}, 0.12),
        ("flat end", "flat", {"diameter_mm": 0.9}, 0.07),
        ("cone", "cone", {"diameter_mm": 1.2}, 0.1),
    ):
        x, y = rng.uniform(-0.28, 0.28, 2)
        yield Pressed(label, kind, sizes, depth, x, y, float(rng.uniform(0, 180)))


def peaks(rig: str, seed: int, believed: float = 1.0) -> Iterator[Peak]:
    """Press every object on one unit."""
    unit = VirtualUnit(rig, seed, unit_overrides(rig, seed), believed=believed)
    profile = unit.pipeline.profile
    options = Poisson.Options(**profile.estimators["height"].options)
    step = Poisson(options, SensorContext(profile.image, profile.gel))
    for pressed in objects(np.random.default_rng([11, seed])):
        found = unit.measured(pressed)
        if found is not None:
            height, truth = found
            top_mm = truth.height_mm.max()
            slopes = true_slopes(truth.height_mm, profile.image.mm_per_px)
            best = step.estimate(slopes)
            seen = is_resolved(truth.height_mm, profile)
            ratios = float(height.mm.max() / top_mm), float(best.mm.max() / top_mm)
            yield Peak(rig, pressed.label, seed, *ratios, seen)


def true_slopes(height_mm: NDArray[Any], mm_per_px: float) -> Gradients:
    """Return the slopes of a surface."""
    gy, gx = (np.asarray(g, np.float32) for g in np.gradient(height_mm, mm_per_px))
    return Gradients(gx, gy, np.ones(gx.shape, bool), mm_per_px, 0.0)


def rows(data: Path, units: int = 3) -> list[Row]:
    """Worst and median error of the peak, by rig; ``data`` is not used."""
    every = [peak for rig in SHIPPED for seed in range(units) for peak in peaks(rig, seed)]
    counted = [peak for peak in every if peak.is_resolved]
    values = {
        rig: float(np.max([abs(p.ratio - 1) for p in counted if p.rig == rig])) for rig in SHIPPED
    }
    medians = {
        f"median, {rig}": float(np.median([abs(p.ratio - 1) for p in counted if p.rig == rig]))
        for rig in SHIPPED
    }
    best = {
        f"worst with true slopes, {rig}": float(
            np.max([abs(p.of_true_slopes - 1) for p in counted if p.rig == rig])
        )
        for rig in SHIPPED
    }
    return [
        Row(
            "peak_heights",
            "error of the peak height over the true peak, worst press",
            "virtual rigs: balls, cylinders, flat ends, and cones that the image resolves",
            f"{len(counted)} presses on {len(SHIPPED) * units} units; {len(every) - len(counted)} "
            f"not resolved",
            "out of sample: other objects on the calibrated unit",
            values,
            max(values.values()),
            {"predict flat": 1.0},
            command("peak_heights"),
            medians | best,
        )
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", action="append", metavar="PROFILE")
    parser.add_argument("--units", type=int, default=3)
    parser.add_argument("--first", type=int, default=0, help="number of the first unit")
    parser.add_argument("--believed", type=float, default=1.0, help="over the true thickness")
    options = parser.parse_args()
    for rig in options.rig or SHIPPED:
        seeds = range(options.first, options.first + options.units)
        found = [peak for seed in seeds for peak in peaks(rig, seed, options.believed)]
        for label in dict.fromkeys(peak.label for peak in found):
            some = [peak for peak in found if peak.label == label]
            cells = " ".join(f"{p.ratio:6.3f}{' ' if p.is_resolved else '*'}" for p in some)
            each = np.array([peak.ratio for peak in some])
            worst = each[np.abs(each - 1).argmax()]
            print(f"{rig:22}{label:10}{cells}  median {np.median(each):.3f} worst {worst:.3f}")
        for what, ratios in (
            ("measured", [peak.ratio for peak in found if peak.is_resolved]),
            ("true slopes", [peak.of_true_slopes for peak in found if peak.is_resolved]),
        ):
            errors = np.abs(np.subtract(ratios, 1))
            print(
                f"{rig:22}resolved, {what}: median {np.median(errors):.1%}, 95 % "
                f"{np.quantile(errors, 0.95):.1%}, worst {np.max(errors):.1%}, bias "
                f"{np.mean(ratios) - 1:+.1%}"
            )


if __name__ == "__main__":
    main()
