"""Scatter of the normals over random splits: ``python benchmarks/accuracy_scatter.py [DATA]``.

``accuracy.json`` has two splits of each set of ball presses, even and odd. Here ten random halves
calibrate, and the other halves are measured: a method is only better or worse than another by more
than this scatter. Of the two grids of balls, each of which is one exposure, ten random halves of
the measured balls are scored.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments import grids, presses
from experiments.press_sets import SETS, Presses
from tactile_core.evaluation.own_resources import one_thread

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
SPLITS, SEED = 10, 7


def over_presses(data: Path, chosen: Presses, rng: np.random.Generator) -> list[float]:
    """Mean error in degrees of each random half, calibrated on the other."""
    folder = data / chosen.folder
    files = np.array(sorted(folder.glob(chosen.pattern)))
    errors = []
    for _ in range(SPLITS):
        order = rng.permutation(len(files))
        seen, unseen = (sorted(files[part]) for part in np.array_split(order, 2))
        errors.append(float(presses.half(folder, chosen, seen, unseen, None).errors_deg.mean()))
    return errors


def over_balls(data: Path, chosen: grids.Grids, rng: np.random.Generator) -> list[float]:
    """Mean error in degrees of random halves of the balls, worse direction."""
    both: list[list[NDArray[np.float64]]] = []
    for seen, unseen in (("001", "002"), ("002", "001")):
        errors, _, count = grids.errors_deg(data / chosen.folder, chosen, seen, unseen)
        both.append(np.array_split(errors, count))
    return [
        max(
            float(np.concatenate([balls[k] for k in rng.permutation(len(balls))[::2]]).mean())
            for balls in both
        )
        for _ in range(SPLITS)
    ]


def main() -> None:
    """Print a line for each set, as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", nargs="?", type=Path, default=DATA)
    data = parser.parse_args().data
    ways = {each.name: partial(over_balls, data, each) for each in (grids.SIX, grids.FOUR)}
    ways |= {
        each.name: partial(over_presses, data, each) for each in SETS if "hex" not in each.name
    }
    print(f"{'set':18}{'mean':>8}{'std':>8}{'least':>8}{'most':>8}   degrees, {SPLITS} splits")
    for name, measure in ways.items():
        errors = np.array(measure(np.random.default_rng(SEED)))
        row = errors.mean(), errors.std(ddof=1), errors.min(), errors.max()
        print(f"{name:18}" + "".join(f"{value:8.2f}" for value in row), flush=True)


if __name__ == "__main__":
    with one_thread():
        main()
