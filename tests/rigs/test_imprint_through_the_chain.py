"""Markers, displacement and slip of a complete chain, on images with known motion."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.imprint_scenes import COLUMNS, MARKER_PX, PITCH_PX, ROWS, scene
from typer.testing import CliRunner

from tactile_core.acquisition.acquisition import average
from tactile_core.cli.app import app
from tactile_core.pipeline.opening import open_sensor
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Frame, MarkerField, SlipState

MM_PER_PX = 0.05
PROFILE = f"""\
schema: 1
name: printed_on
image: {{width_px: {COLUMNS}, height_px: {ROWS}, mm_per_px: {MM_PER_PX}}}
gel: {{markers: {{pitch_mm: {PITCH_PX * MM_PER_PX}, diameter_mm: {MARKER_PX * MM_PER_PX}}}}}
estimators:
  markers: {{use: core.markers}}
  tracking: {{use: core.marker_tracking}}
  displacement: {{use: core.displacement}}
  slip_contact: {{use: core.slip_contact}}
  shear: {{use: core.contact_shear}}
  imprint: {{use: core.imprint_motion}}
  slip: {{use: core.slip}}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "printed_on.yaml"
    made.write_text(PROFILE)
    return made


def frame(
    number: int, object_px: tuple[float, float], surface_px: tuple[float, float] = (0, 0)
) -> Frame:
    pixels, _ = scene(object_px, surface_px=surface_px)
    return Frame(pixels, ("red", "green", "blue"), MM_PER_PX, timestamp_s=number / 30)


def states(profile: Profile, frames: list[Frame]) -> list[SlipState]:
    """Slip states relative to the first frame, which may show a contact."""
    pipeline = Pipeline(profile, None, replace(average(frames[:1]), relative=True))
    return [pipeline.process(frame)[SlipState] for frame in frames]


def test_an_object_that_slides_over_unmoved_gel_slips(path: Path) -> None:
    slides = [frame(n, (3.0 * max(n - 2, 0), 0)) for n in range(10)]
    estimated = states(load_profile(path), slides)
    assert {state.state for state in estimated[:3]} == {"none"}
    assert estimated[-1].state == "slip"
    assert estimated[-1].kind == "translation"


def test_an_object_that_shears_the_gel_does_not_slip(path: Path) -> None:
    paths = [(1.5 * max(n - 2, 0), 0.0) for n in range(10)]
    sheared = [frame(n, offset, surface_px=offset) for n, offset in enumerate(paths)]
    estimated = states(load_profile(path), sheared)
    assert "slip" not in {state.state for state in estimated}


@pytest.mark.parametrize("name", ["object001", "object002", "object003"])
def test_real_lifts_that_slip_are_reported_by_the_complete_chain(
    recordings: Path, name: str
) -> None:
    folder = recordings / "slip" / "grasp_lift"
    with (folder / "labels.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["object"] == name]
    profile = (
        Path(__file__).resolve().parents[2] / "experiments" / "profiles" / "gripper_finger.yaml"
    )
    for row in (rows[0], rows[-1]):
        lift = folder / name / f"{row['trial_folder']}_mm"
        with open_sensor(profile, input=lift, reference="first") as sensor:
            estimated = [reading[SlipState].state for reading in sensor.stream()]
        assert "slip" not in estimated[:6], "nothing moves before the lift"
        assert ("slip" in estimated) == (row["label_stable1_slip0"] == "0")


def test_the_load_of_the_tared_frame_is_zero_from_there_on(path: Path, tmp_path: Path) -> None:
    video, out = tmp_path / "video", tmp_path / "out"
    video.mkdir()
    for number, offset in enumerate([(0, 0), (3, 0), (6, 0), (6, 0), (6, -4)]):
        cv2.imwrite(str(video / f"{number}.png"), scene(offset, surface_px=offset)[0][..., ::-1])
    words = ["run", path, "--input", video, "--reference", video / "0.png"]
    words += ["--tare-frame", 2, "--out", out, "--json"]
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0
    assert len([json.loads(line) for line in done.stdout.splitlines()]) == 5
    moved = []
    for number in range(5):
        with np.load(out / f"{number}.npz") as data:
            inside = data["marker_seen"]
            moved.append(np.median(data["marker_displacement_mm"][inside], axis=0) / MM_PER_PX)
    expected = [(0, 0), (3, 0), (0, 0), (0, 0), (0, -4)]
    np.testing.assert_allclose(moved, expected, atol=0.15)


def test_another_reference_keeps_tare_and_tracks(path: Path) -> None:
    first = frame(0, (0, 0))
    pipeline = Pipeline(path, None, average([first]))
    pipeline.process(first)
    tared = pipeline.process(frame(1, (5, 0), (5, 0)), tare=True)[MarkerField]
    replaced = pipeline.with_reference(average([first]))
    later = replaced.process(frame(2, (5, -3), (5, -3)))[MarkerField]
    np.testing.assert_array_equal(later.ids, tared.ids)
    assert np.abs(tared.displacement_mm).max() == 0
    moved_px = np.median(later.displacement_mm[later.seen], axis=0) / MM_PER_PX
    np.testing.assert_allclose(moved_px, (0, -3), atol=0.15)
