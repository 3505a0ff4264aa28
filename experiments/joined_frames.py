"""Rolled and torn frames of a real sensor: ``python experiments/joined_frames.py DATA``.

The recorded presses of a DIGIT are calibrated, then rolled around their border, and pairs of them
are joined at a line. Prints the share that is noticed, and by how much the heights are wrong.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from benchmarks.altered_frames import LEAST_HEIGHT_MM, RECORDED, Unit, recorded
from tactile_core import HeightMap, ShownGel
from tactile_core.algorithms.arrays.types import Array

LINES = 4, 8, 16, 24, 32, 48, 64, 96, 128, 160
PAIRS = 400
AXES = {0: "columns of the camera", 1: "rows of the camera"}  # it is turned by a quarter


def measured(unit: Unit, pixels: Array) -> tuple[Array, bool]:
    """Return the height in mm, and whether the frame is taken for one of this gel."""
    reading = unit.pipeline.process(unit.frame(np.ascontiguousarray(pixels)))
    return reading[HeightMap].mm, reading[ShownGel].this_gel


def rolls(unit: Unit, heights: dict[str, Array]) -> None:
    """Roll each image by some lines."""
    for axis, name in AXES.items():
        for lines in LINES:
            found = {
                one: measured(unit, np.roll(pixels, lines, axis))
                for one, pixels in unit.images.items()
            }
            noticed = np.mean([not known for _, known in found.values()])
            wrong = [np.abs(mm - heights[one]).max() for one, (mm, _) in found.items()]
            print(f"{lines} {name}: noticed {noticed:.2f}, wrong by {np.median(wrong):.2f} mm")


def tears(unit: Unit, heights: dict[str, Array]) -> None:
    """Join pairs of images; the height is wrong if it is that of neither image."""
    rng = np.random.default_rng(0)
    wrong_mm, noticed = [], []
    for _ in range(PAIRS):
        one, other = rng.choice(list(unit.images), 2, replace=False)
        axis = int(rng.integers(2))
        pixels = np.moveaxis(unit.images[one].copy(), axis, 0)
        line = int(rng.integers(8, len(pixels) - 8))
        pixels[line:] = np.moveaxis(unit.images[other], axis, 0)[line:]
        mm, known = measured(unit, np.moveaxis(pixels, 0, axis))
        wrong_mm.append(min(np.abs(mm - heights[each]).max() for each in (one, other)))
        noticed.append(not known)
    wrong = np.array(wrong_mm) > LEAST_HEIGHT_MM
    share = np.array(noticed)[wrong].mean()
    print(
        f"joined: {wrong.mean():.2f} wrong by more than {LEAST_HEIGHT_MM} mm, {share:.2f} noticed"
    )


def main() -> None:
    (unit,) = (unit for unit in recorded(Path(sys.argv[1]), 99, RECORDED[-1:]))
    found = {name: measured(unit, pixels) for name, pixels in unit.images.items()}
    print(f"not joined: {sum(not known for _, known in found.values())} of {len(found)} warned of")
    heights = {name: mm for name, (mm, _) in found.items()}
    rolls(unit, heights)
    tears(unit, heights)


if __name__ == "__main__":
    main()
