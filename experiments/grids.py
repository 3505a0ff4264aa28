"""Normals on a held-out ball grid, in both directions of the split."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.table_row import Row, command
from tactile_core.calibration.fitting import calibrate
from tactile_core.calibration.presses import angles_deg
from tactile_core.formats.target import BallGrid, read_target
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import played_back, read_frames
from tactile_core.quantities import Gradients

ROOT = Path(__file__).resolve().parents[1]
WITHIN = 0.8
"""Scored radius in ball radii; further out, the ball shadows itself."""


@dataclass(frozen=True)
class Grids:
    """Recordings of two grids on one device; ``{}`` is replaced by a grid's number."""

    name: str
    profile: str | Path
    folder: str
    press: str
    target: str
    reference: str
    what: str


SIX = Grids(
    "six_led_grid",
    "desktop_six_led",
    "six_led/ball_grid",
    "BGA-{}",
    "BGA-{}/bgatarget.yaml",
    "Flat-001",
    "six sequential lights",
)
FOUR = Grids(
    "four_colour_grid",
    ROOT / "examples" / "four_colour.yaml",
    "four_colour/ball_grid",
    "BGA-{}.png",
    "BGA-{}_bgatarget.yaml",
    "Flat-001.png",
    "four simultaneous colours, a linear combination of exposures under single LEDs",
)


def rows(data: Path, grids: Grids) -> list[Row]:
    """Fit on each grid and measure the other."""
    folder = data / grids.folder
    found = {
        f"{seen} → {unseen}": errors_deg(folder, grids, seen, unseen)
        for seen, unseen in (("001", "002"), ("002", "001"))
    }
    values = {way: float(errors.mean()) for way, (errors, _, _) in found.items()}
    counts = [count for _, _, count in found.values()]
    flat = {way: float(flat.mean()) for way, (_, flat, _) in found.items()}
    return [
        Row(
            grids.name,
            "mean error of the normal within 0.8 of the radius, degrees",
            f"{grids.folder}: {grids.what}; one of BGA-001 and BGA-002 fitted, the other measured",
            " and ".join(f"{count} balls" for count in counts),
            "out of sample: another grid on the same device",
            values,
            max(values.values()),
            {f"predict flat, {way}": value for way, value in flat.items()},
            command(grids.name),
        )
    ]


def errors_deg(
    folder: Path, grids: Grids, seen: str, unseen: str
) -> tuple[np.ndarray, np.ndarray, int]:
    """Errors on the balls of the held-out grid, errors of a flat prediction, number of balls."""
    made = calibrate(
        grids.profile,
        folder / grids.press.format(seen),
        folder / grids.reference,
        target=folder / grids.target.format(seen),
        scored=False,
    )
    press = folder / grids.press.format(unseen)
    pipeline = Pipeline(grids.profile, made.bundle)
    profile = played_back(pipeline.profile, press).profile
    pipeline = Pipeline(profile, made.bundle)
    (frame,) = read_frames(profile, press)
    grid = read_target(folder / grids.target.format(unseen)).at_scale(frame.mm_per_px)
    return *on_balls(pipeline.process(frame)[Gradients], grid), len(grid.centres_px)


def on_balls(measured: Gradients, grid: BallGrid) -> tuple[np.ndarray, np.ndarray]:
    """(N,) angular errors on the balls of a target, and those of a flat prediction, degrees.

    Parameters
    ----------
    measured : Gradients
    grid : BallGrid
        Centres in pixels of the measured image.
    """
    height, width = measured.x.shape
    radius_px = grid.radius_mm / measured.mm_per_px
    errors, flat = [], []
    for x0, y0 in grid.centres_px:
        x, y = np.arange(width) - x0, np.arange(height)[:, None] - y0
        on = np.hypot(x, y) < WITHIN * radius_px
        offset = np.stack(np.broadcast_arrays(x, y), -1)[on]
        true = -offset / np.sqrt(radius_px**2 - (offset**2).sum(1))[:, None]
        errors.append(angles_deg(np.stack([measured.x[on], measured.y[on]], 1), true))
        flat.append(angles_deg(np.zeros_like(true), true))
    return np.concatenate(errors), np.concatenate(flat)
