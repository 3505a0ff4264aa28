"""Six sequential lights, on recordings of two ball grids and of an object."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command_line import tactile

from experiments.given_lights import record_object
from experiments.grids import on_balls
from tactile_core.calibration.fitting import calibrate
from tactile_core.formats.target import BallGrid, read_target
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.playback import played_back, read_frames
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap

pytestmark = pytest.mark.recordings

Scene = tuple[Pipeline, Frame, BallGrid]


@pytest.fixture(scope="module")
def unseen(recordings: Path) -> Scene:
    """A pipeline calibrated on one grid, and a frame of another."""
    folder = recordings / "six_led" / "ball_grid"
    made = calibrate(
        "desktop_six_led",
        folder / "BGA-001",
        folder / "Flat-001",
        target=folder / "BGA-001" / "bgatarget.yaml",
        scored=False,
    )
    profile = played_back(load_profile("desktop_six_led"), folder / "BGA-002").profile
    (frame,) = read_frames(profile, folder / "BGA-002")
    grid = read_target(folder / "BGA-002" / "bgatarget.yaml").at_scale(frame.mm_per_px)
    return Pipeline(profile, made.bundle), frame, grid


@pytest.mark.headline
def test_a_held_press_does_not_fade_while_the_lights_drift(unseen: Scene) -> None:
    pipeline, frame, grid = unseen
    before = pipeline.process(frame)
    drift = np.array([1, -1, 0.5, 1, 0, -0.5])
    for minute in range(1, 11):
        drifted = np.rint(frame.pixels * (1 + 0.003 * minute * drift))
        now = pipeline.process(replace(frame, pixels=drifted.astype(np.uint8), sequence=minute))
        assert on_balls(now[Gradients], grid)[0].mean() < 1.6
        assert now[ContactMask].area_mm2 == pytest.approx(before[ContactMask].area_mm2, rel=0.03)
        assert now[HeightMap].mm.max() == pytest.approx(before[HeightMap].mm.max(), rel=0.05)


def test_an_object_under_given_lights_needs_no_bundle(recordings: Path, tmp_path: Path) -> None:
    profile = record_object(recordings / "six_led" / "diligent_bear", tmp_path)
    done = tactile("run", profile, "--input", tmp_path / "bear", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "no bundle: slopes come from the lights" in done.stderr
