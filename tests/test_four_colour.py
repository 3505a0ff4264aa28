"""Four colours at once, on recordings of two ball grids of one device."""

from pathlib import Path

import numpy as np
import pytest

from tactile_core.calibrating import calibrate
from tactile_core.calibrating.presses import angles_deg
from tactile_core.formats.target import read_target
from tactile_core.pipeline import Pipeline
from tactile_core.quantities import Gradients
from tactile_core.sensor import read_frames

EXAMPLE = Path(__file__).parents[1] / "examples" / "four_colour.yaml"


@pytest.mark.recordings
@pytest.mark.parametrize(("seen", "unseen"), [("BGA-001", "BGA-002"), ("BGA-002", "BGA-001")])
def test_balls_of_another_grid_are_measured_to_five_degrees(
    recordings: Path, seen: str, unseen: str
) -> None:
    folder = recordings / "four_colour" / "ball_grid"
    made = calibrate(
        EXAMPLE,
        folder / f"{seen}.png",
        folder / "Flat-001.png",
        target=folder / f"{seen}_bgatarget.yaml",
        model="baxter_fingertip.hue_intensity",
    )
    assert made.score is not None
    assert made.score.mean_deg < 5
    pipeline = Pipeline(EXAMPLE, made.bundle)
    (frame,) = read_frames(pipeline.profile, folder / f"{unseen}.png")
    measured = pipeline.process(frame)[Gradients]
    grid = read_target(folder / f"{unseen}_bgatarget.yaml").at_scale(frame.mm_per_px)
    height, width = frame.pixels.shape[:2]
    radius_px = grid.radius_mm / frame.mm_per_px
    errors = []
    for x0, y0 in grid.centres_px:
        x, y = np.arange(width) - x0, np.arange(height)[:, None] - y0
        on = np.hypot(x, y) < 0.8 * radius_px
        offset = np.stack(np.broadcast_arrays(x, y), -1)[on]
        true = -offset / np.sqrt(radius_px**2 - (offset**2).sum(1))[:, None]
        errors.append(angles_deg(np.stack([measured.x[on], measured.y[on]], 1), true))
    assert np.concatenate(errors).mean() < 2.5
