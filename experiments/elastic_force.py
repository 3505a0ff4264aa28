"""Force by inverting the mechanics of the gel: ``python experiments/elastic_force.py``.

Virtual units are calibrated and pressed with shapes that nobody trained on; the whole chain
measures rendered images. Prints R² of each component of ``core.force_elastic`` against the
simulator's force, also where the profile gives a wrong gel to the whole chain, and after one common
factor, which a wrong modulus takes; then, for gels that are wrong at random, how often the
simulator's force is within one standard deviation, in each fifth of the standard deviations.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from experiments.virtual_unit import VirtualUnit
from tactile_core.algorithms.arrays.types import Array
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Frame, Wrench

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

TOUCHES = 2
"""Presses of each shape."""

WRONG: tuple[tuple[float, float, float], ...] = (
    (1, 1, 1),
    (1.1, 1, 1),
    (0.9, 1, 1),
    (1, 0.9, 1),
    (1, 1.1, 1),
    (1, 1, 0.9),
    (1, 1, 1.04),
    (1, 0.9, 0.9),
    (1, 1.1, 0.9),
    (1, 1.1, 1.04),
)
"""Factors on modulus, thickness and Poisson's ratio."""

MODULI = 25
"""Random moduli for each random thickness and Poisson's ratio."""
TOLERANCE = 0.1
"""Standard deviation of random factors."""


class Sample(NamedTuple):
    """The force that acted, and those that the chains measured: fx, fy, fz in N, tz in N·mm."""

    true: Array
    found: list[Wrench]


def pipelines(unit: VirtualUnit, rig: str, factors: Array) -> list[Pipeline]:
    """Return a chain for each wrong gel."""
    gel, found = load_profile(rig).gel, []
    names = "shear_modulus_mpa", "thickness_mm", "poisson_ratio"
    for row in factors:
        wrong = {name: getattr(gel, name) * by for name, by in zip(names, row, strict=True)}
        wrong["poisson_ratio"] = min(wrong["poisson_ratio"], 0.499)
        overrides: dict[str, Any] = {
            "gel": wrong,
            "estimators": {"force": {"use": "core.force_elastic"}},
        }
        profile = load_profile(rig, sim=True, overrides=overrides)
        found.append(Pipeline(profile, unit.pipeline.bundle))
    return found


def touches(unit: VirtualUnit, seed: int) -> Iterator[list[tuple[Frame, Array | None]]]:
    """Press, shear and twist every shape; yields frames, with the force where it is scored."""
    stage, rng = unit.stage, np.random.default_rng(seed)
    for kind, sizes, deepest_mm in SHAPES:
        for _ in range(TOUCHES):
            stage.reset()
            frames: list[tuple[Frame, Array | None]] = [(stage.frame(), None)]
            x_mm, y_mm = rng.uniform(-0.2, 0.2, 2) * unit.view_mm
            angle = float(rng.uniform(0, 180))
            stage.indenter(kind, x_mm=float(x_mm), y_mm=float(y_mm), angle_deg=angle, **sizes)
            stage.press(depth_mm=float(deepest_mm * rng.uniform(0.4, 1)))
            frames.append((stage.frame(), stage.truth().wrench))
            way, far_mm = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.5)
            dx_mm, dy_mm = far_mm * np.cos(way) / 3, far_mm * np.sin(way) / 3
            for scored in (False, False, True):
                stage.shear(dx_mm=float(dx_mm), dy_mm=float(dy_mm))
                frames.append((stage.frame(), stage.truth().wrench if scored else None))
            stage.twist(degrees=float(rng.uniform(-8, 8)), steps=3)
            frames.append((stage.frame(), stage.truth().wrench))
            yield frames


def samples(rig: str, seed: int, factors: Array) -> list[Sample]:
    """Measure every touch of one unit with every wrong gel."""
    unit = VirtualUnit(rig, seed, {})
    chains, found = pipelines(unit, rig, factors), []
    for touch in touches(unit, seed):
        for chain in chains:
            chain.reset()
        for frame, wrench in touch:
            readings = [chain.process(frame) for chain in chains]
            if wrench is not None:
                found.append(Sample(wrench, [reading[Wrench] for reading in readings]))
    return found


def r_squared(found: Array, true: Array) -> Array:
    """R² of each column."""
    rest = ((found - true) ** 2).sum(0)
    return np.asarray(1 - rest / ((true - true.mean(0)) ** 2).sum(0))


def covered(error: Array, std: Array) -> list[float]:
    """Share of errors within one standard deviation, in each fifth of the standard deviations."""
    fifth = np.digitize(std, np.quantile(std, [0.2, 0.4, 0.6, 0.8]))
    return [float((np.abs(error) < std)[fifth == number].mean()) for number in range(5)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--random", type=int, default=6, help="gels that are wrong at random")
    given = parser.parse_args()
    rng = np.random.default_rng(0)
    errors, stds, true, found = [], [], [], []
    for seed in given.seeds:
        drawn = 1 + TOLERANCE * np.random.default_rng([seed, 1]).standard_normal((given.random, 3))
        for sample in samples(given.rig, seed, np.array([*WRONG, *drawn])):
            values = np.array([wrench.values for wrench in sample.found])
            true.append(sample.true)
            found.append(values[: len(WRONG)])
            for factors, wrench in zip(drawn, sample.found[len(WRONG) :], strict=True):
                # a modulus scales force and standard deviation, so that more of them cost nothing
                scales = (1 + TOLERANCE * rng.standard_normal((MODULI, 1))) / factors[0]
                errors += list(scales * wrench.values - sample.true)
                stds += list(scales * wrench.std)
    acted, measured = np.array(true), np.array(found)
    print(f"{len(acted)} readings; largest {np.abs(acted).max(0).round(2)} N, N, N, N·mm")
    print("modulus, thickness, Poisson's ratio: R² of fx, fy, fz, tz; after one factor each")
    for number, factors in enumerate(WRONG):
        by = measured[:, number]
        scaled = by * (by * acted).sum(0) / (by**2).sum(0)
        shown = [" ".join(f"{one:6.3f}" for one in r_squared(of, acted)) for of in (by, scaled)]
        print(f"{factors}: {shown[0]} | {shown[1]}")
    if given.random:
        print("within one standard deviation, by fifths of it; all")
        for column, name in enumerate(("fx", "fy", "fz", "tz")):
            error, std = np.array(errors)[:, column], np.array(stds)[:, column]
            shares = [*covered(error, std), float((np.abs(error) < std).mean())]
            print(name, " ".join(f"{100 * share:3.0f} %" for share in shares))


if __name__ == "__main__":
    main()
