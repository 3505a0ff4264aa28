"""A folder of short recordings of the virtual lab."""

from __future__ import annotations

import os
from pathlib import Path

from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress


def many_recordings(
    lab: VirtualLab, folder: Path, names: tuple[str, ...] = ("lift_1", "lift_2"), frames: int = 3
) -> Path:
    """Write recordings of a few images each; the images of one are links to one another."""
    for number, name in enumerate(names):
        press = BallPress((60.0 + 5 * number, 62.0), BALL_MM, 0.8)
        first = lab.save(folder / name / "f000.png", press)
        for frame in range(1, frames):
            os.link(first, first.with_name(f"f{frame:03d}.png"))
    return folder
