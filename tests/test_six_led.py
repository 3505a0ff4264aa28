"""Six lamps in turn, on recordings of two ball grids of one device and of an object."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from ball_grids import errors_deg
from cli.test_cli import tactile
from scipy.io import loadmat

from tactile_core.acquisition import average
from tactile_core.bundle import Bundle
from tactile_core.calibrating.known import balls
from tactile_core.calibration import Calibration
from tactile_core.formats.target import BallGrid, read_target
from tactile_core.manifest import Manifest
from tactile_core.pipeline import Pipeline
from tactile_core.plugins import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.profiles.model import Profile
from tactile_core.progress import Silent
from tactile_core.quantities import ContactMask, Frame, Gradients, HeightMap
from tactile_core.sensor import played_back, read_frames

pytestmark = pytest.mark.recordings

OBJECT = """\
schema: 1
name: bear
image:
  {width_px: 612, height_px: 512, mm_per_px: 0.1, color: grey, transfer: linear, bit_depth: 16}
calibration: {use: desktop_six_led.photometric_stereo, lights: given}
estimators: {height: {use: core.robust_poisson}}
illumination: {use: core.sequential, lights: [
"""

Scene = tuple[Pipeline, Frame, BallGrid]


@pytest.fixture(scope="module")
def unseen(recordings: Path) -> Scene:
    """A pipeline that knows one grid, and a frame of another.

    Fitted as ``calibrate`` does, without its score, which takes five fits more.
    """
    folder = recordings / "six_led" / "ball_grid"
    profile, _ = played_back(load_profile("desktop_six_led"), folder / "BGA-001")
    untouched = average(list(read_frames(profile, folder / "Flat-001")))
    (press,) = read_frames(profile, folder / "BGA-001")
    known = balls(
        profile,
        folder / "BGA-001",
        [press],
        untouched,
        target=folder / "BGA-001" / "bgatarget.yaml",
        progress=Silent(),
    )
    samples = [ball.training() for ball in known.surfaces if ball.used]
    model: type[Calibration] = resolve("calibration", profile.calibration.use)
    options = model.Options.model_validate(profile.calibration.options)
    fitted = model.fit([*samples, *known.resting], untouched, options)
    bundle = Bundle(_manifest(profile, press), fitted, untouched)
    profile, _ = played_back(profile, folder / "BGA-002")
    (frame,) = read_frames(profile, folder / "BGA-002")
    grid = read_target(folder / "BGA-002" / "bgatarget.yaml").at_scale(frame.mm_per_px)
    return Pipeline(profile, bundle), frame, grid


def _manifest(profile: Profile, frame: Frame) -> Manifest:
    return Manifest(
        profile=profile.name,
        model=profile.calibration.use,
        image_size_px=(profile.image.width_px, profile.image.height_px),
        channels=frame.channels,
        mm_per_px=profile.image.mm_per_px,
    )


def test_balls_of_another_grid_are_measured_to_a_degree(unseen: Scene) -> None:
    pipeline, frame, grid = unseen
    errors = errors_deg(pipeline.process(frame)[Gradients], grid)
    assert errors.mean() < 1.3


def test_a_press_that_is_held_stays_while_the_lamps_drift(unseen: Scene) -> None:
    pipeline, frame, grid = unseen
    before = pipeline.process(frame)
    away = np.array([1, -1, 0.5, 1, 0, -0.5])
    for minute in range(1, 11):
        shone = np.rint(frame.pixels * (1 + 0.003 * minute * away))
        now = pipeline.process(replace(frame, pixels=shone.astype(np.uint8), sequence=minute))
        assert errors_deg(now[Gradients], grid).mean() < 1.6
        assert now[ContactMask].area_mm2 == pytest.approx(before[ContactMask].area_mm2, rel=0.02)
        assert now[HeightMap].mm.max() == pytest.approx(before[HeightMap].mm.max(), rel=0.05)


def test_an_object_under_given_lights_needs_no_bundle(recordings: Path, tmp_path: Path) -> None:
    folder = recordings / "six_led" / "diligent_bear"
    profile = record_object(folder, tmp_path)
    done = tactile("run", profile, "--input", tmp_path / "bear", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "no bundle: slopes come from the lights" in done.stderr
    with np.load(tmp_path / "out" / "bear.npz") as data:
        slopes = data["gradients"]
    where = np.asarray(cv2.imread(str(folder / "mask.png"), cv2.IMREAD_GRAYSCALE)) > 0
    x, y = slopes[where].T
    found = np.column_stack([-x, y, np.ones_like(x)])  # this data set's y is up
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    true = loadmat(str(folder / "Normal_gt.mat"))["Normal_gt"][where]
    errors = np.degrees(np.arccos(np.clip((found * true).sum(axis=1), -1, 1)))
    assert errors.mean() < 8.5


def record_object(folder: Path, into: Path) -> Path:
    """Write a data set's exposures in grey, over their lamps' strengths, and the rig's profile."""
    names = (folder / "filenames.txt").read_text().split()
    chosen = [k for k, name in enumerate(names) if (folder / name).exists()]
    lights = np.loadtxt(folder / "light_directions.txt")[chosen]
    strengths = np.loadtxt(folder / "light_intensities.txt")[chosen, ::-1]
    exposures = []
    for k, strength in zip(chosen, strengths, strict=True):
        image = np.asarray(cv2.imread(str(folder / names[k]), cv2.IMREAD_UNCHANGED))
        exposures.append(np.mean(image / strength, axis=2))
    brightest = max(exposure.max() for exposure in exposures)
    (into / "bear").mkdir()
    lines = []
    for k, (exposure, (x, y, z)) in enumerate(zip(exposures, lights, strict=True)):
        level = np.rint(65535 * exposure / brightest).astype(np.uint16)
        cv2.imwrite(str(into / "bear" / f"{k}.png"), level)
        azimuth, elevation = np.degrees([np.arctan2(-y, x), np.arcsin(z)])
        lines.append(
            f"{{name: light{k}, azimuth_deg: {azimuth:.3f}, elevation_deg: {elevation:.3f}}}"
        )
    profile = into / "bear.yaml"
    profile.write_text(OBJECT + ",\n".join(lines) + "]}\n")
    return profile
