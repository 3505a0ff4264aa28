"""Normal force of a gel without markers, before and after one known weight is laid on.

``python experiments/known_weight.py [RIG]``. Virtual units are pressed and sheared with eight
shapes; the profile is wrong in modulus, thickness and Poisson's ratio. Each shape is the weight in
turn, and all touches are measured with the stiffness that it gives.
"""

from __future__ import annotations

import sys

import numpy as np

from experiments.elastic_force import SHAPES, pipelines, touches
from experiments.virtual_unit import VirtualUnit
from tactile_core.quantities import Wrench

WRONG = np.array(
    [
        (1, 1, 1),
        (1.5, 1, 1),
        (1, 0.9, 1),
        (1, 1.1, 1),
        (1, 1, 0.96),
        (1, 1, 1.03),
        (1.5, 0.9, 1.03),
        (0.7, 1.1, 0.96),
    ]
)
UNITS = (1, 2)


def main() -> None:
    """Print one line for each wrong gel."""
    rig = sys.argv[1] if len(sys.argv) > 1 else "hex_fingertip_unmarked"
    true, found = [], []
    for seed in UNITS:
        unit = VirtualUnit(rig, seed, {})
        chains = pipelines(unit, rig, WRONG)
        for touch in touches(unit, seed):
            for frame, wrench in touch:
                forces_n = [chain.process(frame)[Wrench].fz_n for chain in chains]
                if wrench is not None:
                    true.append(wrench[2])
                    found.append(forces_n)
    ratios = np.array(found) / np.array(true)[:, None]
    shape = np.tile(np.repeat(np.arange(len(SHAPES)), len(true) // len(UNITS) // len(SHAPES)), 2)
    first = [int(np.flatnonzero(shape == number)[0]) for number in range(len(SHAPES))]
    for wrong, ratio in zip(WRONG, ratios.T, strict=True):
        low, median, high = np.quantile(ratio, (0.05, 0.5, 0.95))
        after = np.concatenate([ratio / ratio[one] for one in first]) - 1
        rms, most = np.sqrt(np.mean(after**2)), np.quantile(np.abs(after), 0.95)
        print(
            f"modulus, thickness, ratio {tuple(wrong.tolist())}: measured / true {median:.2f} "
            f"({low:.2f} to {high:.2f}); after one weight RMS {rms:.1%}, 95 % {most:.1%}"
        )


if __name__ == "__main__":
    main()
