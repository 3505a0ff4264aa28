"""Measured against true normals on a pressed ball, per press and for all.

``python benchmarks/ball_normals.py PROFILE BUNDLE PRESSES REFERENCE DIAMETER_MM``; the presses are
not those of the calibration. As in figure 13 of W. Yuan, S. Dong and E. H. Adelson, Sensors 17(12),
2017.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.presses import angles_deg
from tactile_core.calibration.targets import balls, undeformed_sensor
from tactile_core.cli.output import table_lines
from tactile_core.interfaces.calibration import Silent
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Gradients

STEEP_DEG = 5  # yaw is undefined on level gel


def row(name: str, slopes: Array) -> list[str]:
    """Return the errors of (N, 4) measured and true slopes."""
    both = np.stack([slopes[:, :2], slopes[:, 2:]])
    pitch = np.degrees(np.arctan(np.hypot(both[..., 0], both[..., 1])))
    yaw = np.degrees(np.arctan2(both[..., 1], both[..., 0]))
    turned = ((yaw[0] - yaw[1] + 180) % 360 - 180)[pitch[1] > STEEP_DEG]
    return [
        name,
        str(len(slopes)),
        f"{angles_deg(slopes[:, :2], slopes[:, 2:]).mean():.2f}°",
        f"{np.sqrt(np.mean((pitch[0] - pitch[1]) ** 2)):.2f}°",
        f"{np.sqrt(np.mean(turned**2)):.2f}°",
        f"{np.sum(pitch[0] * pitch[1]) / np.sum(pitch[1] ** 2):.3f}",
    ]


def main() -> None:
    """Print the table."""
    profile, bundle, presses, reference, diameter_mm = sys.argv[1:]
    base, fitted = load_profile(profile), Bundle.load(Path(bundle))
    frames = list(read_frames(base, Path(presses)))
    undeformed, _ = undeformed_sensor(base, frames, Path(reference), None, fitted.reference)
    pipeline = Pipeline(base, fitted, undeformed)
    found = balls(
        base,
        Path(presses),
        frames,
        pipeline.conditioning,
        ball_diameter_mm=float(diameter_mm),
        progress=Silent(),
    )
    rows, slopes = [], []
    for press, frame in zip(found.surfaces, frames, strict=True):
        if press.used:
            measured = pipeline.process(frame)[Gradients]
            y, x, true = press.true_gradients(press.scored_area())
            slopes.append(np.column_stack([measured.x[y, x], measured.y[y, x], true]))
            rows.append(row(press.file, slopes[-1]))
    header = ["press", "pixels", "normal error", "pitch RMSE", "yaw RMSE", "pitch, measured/true"]
    print("\n".join(table_lines(header, [*rows, row("all", np.concatenate(slopes))])))


if __name__ == "__main__":
    main()
