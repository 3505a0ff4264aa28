"""Light flat contacts under shear: ``python -m experiments.sheared_discs --seeds 30 31``.

Discs of 9 to 14 mm are pressed 0.05 to 0.08 mm deep into virtual units and sheared until they slip;
the whole chain measures rendered images. Prints the contact area and the normal force over the true
ones, and the share of frames in which the contact is lost.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from experiments.friction import chain
from experiments.virtual_unit import VirtualUnit
from tactile_core.quantities import ContactMask, Wrench
from tactile_sim.stage import VirtualStage

DISCS_MM = ((12.0, 0.067), (10.0, 0.083), (9.0, 0.05), (14.0, 0.067))
"""Diameters and depths."""

FRICTION, STEP_MM, STEPS = 0.7, 0.06, 14
"""Coefficient, motion per frame, and frames of each disc."""

LOST = 0.85
"""A contact of less than this share of the true area is lost."""


def ratios(rig: str, seed: int) -> Iterator[tuple[float, float]]:
    """Yield the area and the normal force of each frame over the true ones."""
    unit = VirtualUnit(rig, seed, {})
    stage = VirtualStage(rig, seed, overrides={"gel": {"friction": FRICTION}})
    pipeline = chain(unit, rig, FRICTION)
    rng = np.random.default_rng(seed + 1000)
    for diameter_mm, depth_mm in DISCS_MM:
        stage.reset()
        pipeline.reset()
        pipeline.process(stage.frame())
        x_mm, y_mm = float(rng.uniform(-2, 2)), float(rng.uniform(-1, 1))
        stage.indenter("flat", x_mm=x_mm, y_mm=y_mm, diameter_mm=diameter_mm)
        stage.press(depth_mm=depth_mm)
        way = rng.uniform(0, 2 * np.pi)
        dx_mm, dy_mm = STEP_MM * float(np.cos(way)), STEP_MM * float(np.sin(way))
        for _ in range(STEPS):
            stage.shear(dx_mm=dx_mm, dy_mm=dy_mm)
            reading, truth = pipeline.process(stage.frame()), stage.truth()
            area = np.count_nonzero(reading[ContactMask].mask) / np.count_nonzero(truth.contact)
            yield area, reading[Wrench].fz_n / truth.wrench[2]


def main() -> None:
    """Print one line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[30, 31])
    given = parser.parse_args()
    found = np.array([pair for seed in given.seeds for pair in ratios(given.rig, seed)])
    low, middle, high = np.quantile(found, (0.05, 0.5, 0.95), axis=0)
    print(
        f"{len(found)} frames: contact lost in {100 * np.mean(found[:, 0] < LOST):.1f} %; area, "
        f"5 % to 95 %: {low[0]:.2f} to {high[0]:.2f}; normal force: {low[1]:.2f} to {high[1]:.2f}, "
        f"median {middle[1]:.2f}"
    )


if __name__ == "__main__":
    main()
