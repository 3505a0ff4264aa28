"""A fitted force on shapes that it was not fitted on: ``python -m experiments.fitted_force``.

Virtual units are calibrated and pressed, sheared and twisted with eight shapes, as in
``elastic_force.py``; ``core.force_linear`` is fitted to seven of them and predicts the eighth.
Prints R² of each component, and the share of the errors within one standard deviation.
"""

from __future__ import annotations

import argparse

import numpy as np

from experiments.elastic_force import SHAPES, TOUCHES, touches
from experiments.virtual_unit import VirtualUnit
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.builtin.force_linear import LinearForce
from tactile_core.calibration.force.result import held_out_forces, score_forces
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import ForceSamples, SensorContext
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import ContactMask, DisplacementField, HeightMap


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", default="hex_fingertip")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    given = parser.parse_args()
    profile = load_profile(given.rig)
    step = LinearForce(Options(), SensorContext(profile.image, profile.gel))
    for seed in given.seeds:
        unit = VirtualUnit(given.rig, seed, {})
        features: list[list[Float64]] = [[] for _ in SHAPES]
        forces: list[list[Float64]] = [[] for _ in SHAPES]
        for number, touch in enumerate(touches(unit, seed)):
            shape = number // TOUCHES
            unit.pipeline.reset()
            for frame, wrench in touch:
                reading = unit.pipeline.process(frame)
                if wrench is None:
                    continue
                field, contact = reading[DisplacementField], reading[ContactMask]
                given_now = field, None, contact, reading[HeightMap], None
                features[shape].append(step.features(*given_now))
                forces[shape].append(wrench)
        sequences = [
            ForceSamples(f"{kind} {sizes}", np.array(found), np.array(true))
            for (kind, sizes, _), found, true in zip(SHAPES, features, forces, strict=True)
        ]
        scores = score_forces(sequences, *held_out_forces(sequences, step.fit))
        words = [f"{name} {one.r2:.3f} ({one.within_std:.0%})" for name, one in scores.items()]
        print(f"unit {seed}: {', '.join(words)}", flush=True)


if __name__ == "__main__":
    main()
