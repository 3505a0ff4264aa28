"""Force by inverting the mechanics of the gel: ``python experiments/elastic_force.py``.

Virtual units are calibrated and pressed with shapes that nobody trained on; height, contact and
displacement are those that the whole chain measures in rendered images. Prints R² of each component
of ``core.force_elastic`` against the simulator's force, also with wrong properties of the gel, and
after one common factor, which a wrong modulus takes.
"""

from __future__ import annotations

import argparse
from time import perf_counter
from typing import NamedTuple

import numpy as np

from experiments.virtual_unit import VirtualUnit
from tactile_core.algorithms.arrays.types import Array
from tactile_core.builtin.force_elastic import ElasticForce
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import ContactMask, DisplacementField, HeightMap

SHAPES: tuple[tuple[str, dict[str, float], float], ...] = (
    ("sphere", {"diameter_mm": 6}, 0.6),
    ("sphere", {"diameter_mm": 12}, 0.6),
    ("sphere", {"diameter_mm": 25}, 0.6),
    ("sphere", {"diameter_mm": 50}, 0.6),
    ("cylinder", {"diameter_mm": 10, "length_mm": 12}, 0.45),
    ("cylinder", {"diameter_mm": 22, "length_mm": 12}, 0.45),
    ("flat", {"diameter_mm": 6}, 0.3),
    ("flat", {"diameter_mm": 9}, 0.3),
)
"""Kind, sizes and greatest depth in mm."""

WRONG = ((1.0, 1.0, 1.0), (1.1, 1, 1), (1, 0.9, 1), (1, 1.1, 1), (1, 1, 0.9), (1, 1, 1.04))
"""Factors on modulus, thickness and Poisson's ratio."""


class Sample(NamedTuple):
    """What the chain measured, and the force that acted: fx, fy, fz in N and tz in N·mm."""

    height: HeightMap
    contact: ContactMask
    displacement: DisplacementField
    wrench: Array


def samples(rig: str, seed: int) -> list[Sample]:
    """Press, shear and twist every shape on one unit."""
    unit, rng = VirtualUnit(rig, seed, {}), np.random.default_rng(seed)
    stage, pipeline = unit.stage, unit.pipeline
    found = []

    def measured() -> None:
        reading = pipeline.process(stage.frame())
        quantities = reading[HeightMap], reading[ContactMask], reading[DisplacementField]
        found.append(Sample(*quantities, stage.truth().wrench))

    for kind, sizes, deepest_mm in SHAPES:
        for _ in range(2):
            stage.reset()
            pipeline.reset()
            pipeline.process(stage.frame())
            x_mm, y_mm = rng.uniform(-0.2, 0.2, 2) * unit.view_mm
            angle = float(rng.uniform(0, 180))
            stage.indenter(kind, x_mm=float(x_mm), y_mm=float(y_mm), angle_deg=angle, **sizes)
            stage.press(depth_mm=float(deepest_mm * rng.uniform(0.4, 1)))
            measured()
            way, far_mm = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.5)
            dx, dy = far_mm * np.cos(way) / 3, far_mm * np.sin(way) / 3
            for _ in range(2):
                stage.shear(dx_mm=float(dx), dy_mm=float(dy))
                pipeline.process(stage.frame())
            stage.shear(dx_mm=float(dx), dy_mm=float(dy))
            measured()
            stage.twist(degrees=float(rng.uniform(-8, 8)), steps=3)
            measured()
    return found


def force_step(rig: str, factors: tuple[float, float, float]) -> ElasticForce:
    """Return the step for a gel whose properties are wrong by these factors."""
    profile = load_profile(rig)
    names = "shear_modulus_mpa", "thickness_mm", "poisson_ratio"
    wrong = {name: getattr(profile.gel, name) * by for name, by in zip(names, factors, strict=True)}
    context = SensorContext(profile.image, profile.gel.model_copy(update=wrong))
    return ElasticForce(Options(), context)


def r_squared(found: Array, true: Array) -> Array:
    """R² of each column."""
    rest = ((found - true) ** 2).sum(0)
    return np.asarray(1 - rest / ((true - true.mean(0)) ** 2).sum(0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    given = parser.parse_args()
    taken = [sample for seed in given.seeds for sample in samples(given.rig, seed)]
    true = np.array([sample.wrench for sample in taken])
    print(f"{len(taken)} samples; largest {np.abs(true).max(0).round(2)} N, N, N, N·mm")
    print("modulus, thickness, Poisson's ratio: R² of fx, fy, fz, tz; after one factor each; ms")
    for factors in WRONG:
        step = force_step(given.rig, factors)
        began_s = perf_counter()
        found = np.array([step.estimate(*sample[:3]).values for sample in taken])
        each_ms = 1e3 * (perf_counter() - began_s) / len(taken)
        scaled = found * (found * true).sum(0) / (found**2).sum(0)
        shown = [" ".join(f"{one:6.3f}" for one in r_squared(by, true)) for by in (found, scaled)]
        print(f"{factors}: {shown[0]} | {shown[1]} | {each_ms:.1f}", flush=True)


if __name__ == "__main__":
    main()
