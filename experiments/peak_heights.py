"""Peak height of virtual objects on every rig: ``python experiments/peak_heights.py``.

Each unit is calibrated by ball presses with the profile's defaults, and presses balls, cylinders,
round flat ends and cones that no calibration has seen. Prints the measured peak over the true one
for each rig, object and unit. An object whose peak the smoothing of the calibration lowers by more
than 2 %, such as a cone's tip, is marked by * and not counted.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.table_row import Row, command
from experiments.virtual_unit import Pressed, VirtualUnit, unit_overrides
from tactile_core.profiles.loader import list_rigs
from tactile_sim.demonstration import is_resolved

SHIPPED = ("baxter_fingertip", "desktop_six_led", "desktop_three_colour", "hex_fingertip")


@dataclass(frozen=True)
class Peak:
    """Measured over true peak of one press."""

    rig: str
    label: str
    seed: int
    ratio: float
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


def peaks(rig: str, seed: int) -> Iterator[Peak]:
    """Press every object on one unit."""
    unit = VirtualUnit(rig, seed, unit_overrides(rig, seed))
    for pressed in objects(np.random.default_rng([11, seed])):
        found = unit.measured(pressed)
        if found is not None:
            height, truth = found
            ratio = float(height.mm.max() / truth.height_mm.max())
            seen = is_resolved(truth.height_mm, unit.pipeline.profile)
            yield Peak(rig, pressed.label, seed, ratio, seen)


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
            medians,
        )
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", choices=[e.name for e in list_rigs()], action="append")
    parser.add_argument("--units", type=int, default=3)
    options = parser.parse_args()
    for rig in options.rig or SHIPPED:
        found = [peak for seed in range(options.units) for peak in peaks(rig, seed)]
        for label in dict.fromkeys(peak.label for peak in found):
            some = [peak for peak in found if peak.label == label]
            cells = " ".join(f"{p.ratio:6.3f}{' ' if p.is_resolved else '*'}" for p in some)
            ratios = np.array([peak.ratio for peak in some])
            worst = ratios[np.abs(ratios - 1).argmax()]
            print(f"{rig:22}{label:10}{cells}  median {np.median(ratios):.3f} worst {worst:.3f}")
        errors = [abs(peak.ratio - 1) for peak in found if peak.is_resolved]
        print(f"{rig:22}resolved: median {np.median(errors):.1%}, worst {np.max(errors):.1%}")


if __name__ == "__main__":
    main()
