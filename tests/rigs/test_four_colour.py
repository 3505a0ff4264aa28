"""Four colours on a recording of a grid of balls; test_headline_numbers.py uses another one."""

from pathlib import Path

import pytest

from tactile_core.calibration.fitting import calibrate

EXAMPLE = Path(__file__).parents[2] / "examples" / "four_colour.yaml"


@pytest.mark.recordings
@pytest.mark.headline
def test_held_out_balls_of_a_grid_are_measured_within_two_degrees(recordings: Path) -> None:
    folder = recordings / "four_colour" / "ball_grid"
    made = calibrate(
        EXAMPLE,
        folder / "BGA-001.png",
        folder / "Flat-001.png",
        target=folder / "BGA-001_bgatarget.yaml",
    )
    assert made.bundle.manifest.model == "baxter_fingertip.hue_intensity"
    assert made.score is not None
    assert made.score.mean_deg < 2.1
