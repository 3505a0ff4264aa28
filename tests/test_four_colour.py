"""Four colours at once, on recordings of two ball grids of one device."""

from pathlib import Path

import pytest
from ball_grids import errors_deg

from tactile_core.calibrating import calibrate
from tactile_core.formats.target import read_target
from tactile_core.pipeline import Pipeline
from tactile_core.quantities import Gradients
from tactile_core.sensor import read_frames

EXAMPLE = Path(__file__).parents[1] / "examples" / "four_colour.yaml"


@pytest.mark.recordings
@pytest.mark.parametrize(("seen", "unseen"), [("BGA-001", "BGA-002"), ("BGA-002", "BGA-001")])
def test_hue_and_intensity_measure_balls_of_another_grid_to_two_degrees(
    recordings: Path, seen: str, unseen: str
) -> None:
    folder = recordings / "four_colour" / "ball_grid"
    made = calibrate(
        EXAMPLE,
        folder / f"{seen}.png",
        folder / "Flat-001.png",
        target=folder / f"{seen}_bgatarget.yaml",
    )
    assert made.bundle.manifest.model == "baxter_fingertip.hue_intensity"
    assert made.score is not None
    assert made.score.mean_deg < 2.1
    pipeline = Pipeline(EXAMPLE, made.bundle)
    (frame,) = read_frames(pipeline.profile, folder / f"{unseen}.png")
    measured = pipeline.process(frame)[Gradients]
    grid = read_target(folder / f"{unseen}_bgatarget.yaml").at_scale(frame.mm_per_px)
    errors = errors_deg(measured, grid)
    assert errors.mean() < 2.1
