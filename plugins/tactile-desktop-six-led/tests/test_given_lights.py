"""Photometric stereo with given light directions, on a ball with shadows and highlights."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.test_cli import tactile
from numpy.typing import NDArray

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.illumination import Light
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.quantities import Frame, Gradients, HeightMap, Reference
from tactile_desktop_six_led.given_lights import GivenLights, light_directions, robust_normals
from tactile_desktop_six_led.photometric_stereo import PhotometricCalibrator, StereoOptions

AZIMUTHS = [-90.0, -150.0, 150.0, 90.0, 30.0, -30.0]
LIGHTS = light_directions(AZIMUTHS, [60.0] * 6)


def normals_of_a_ball(count: int = 2000) -> NDArray[np.float32]:
    rng = np.random.default_rng(0)
    normal_xy = rng.uniform(-0.6, 0.6, (count, 2))
    return np.column_stack([normal_xy, np.sqrt(1 - (normal_xy**2).sum(1))]).astype(np.float32)


def off_deg(found: NDArray[np.float32], true: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.degrees(np.arccos(np.clip((found * true).sum(1), -1, 1)))


def test_azimuths_run_from_x_towards_y() -> None:
    assert light_directions([0.0], [0.0])[0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert light_directions([90.0], [0.0])[0] == pytest.approx([0, 1, 0], abs=1e-6)


@pytest.mark.parametrize("count", [3, 4, 6])
def test_a_lambertian_ball_of_any_albedo_is_exact(count: int) -> None:
    true = normals_of_a_ball()
    lights = light_directions(np.arange(count) * 360 / count, [60.0] * count)
    albedo = np.random.default_rng(1).uniform(0.2, 1, (len(true), 1)).astype(np.float32)
    assert off_deg(robust_normals(albedo * (true @ lights.T), lights), true).max() < 0.1


@pytest.mark.parametrize("level", [0.0, 3.0], ids=["shadow", "highlight"])
def test_an_outlier_light_is_rejected(level: float) -> None:
    true = normals_of_a_ball()
    light = true @ LIGHTS.T
    light[np.arange(len(true)), np.arange(len(true)) % 6] = level
    assert off_deg(robust_normals(light, LIGHTS), true).mean() < 0.5


def test_a_profile_can_select_given_lights() -> None:
    lights = [Light(f"led{k}", azimuth, 60.0) for k, azimuth in enumerate(AZIMUTHS)]
    given = PhotometricCalibrator(StereoOptions(lights="given"))
    assert isinstance(given.from_lights(lights), GivenLights)
    assert PhotometricCalibrator(StereoOptions()).from_lights(lights) is None


def test_loaded_directions_equal_the_saved_ones(tmp_path: Path) -> None:
    GivenLights(LIGHTS).save(tmp_path)
    np.testing.assert_array_equal(GivenLights.load(tmp_path)._directions, LIGHTS)


@pytest.mark.parametrize("directions", [None, np.zeros(3), np.full((6, 3), np.nan)])
def test_invalid_directions_are_refused(
    tmp_path: Path, directions: NDArray[np.float64] | None
) -> None:
    if directions is not None:
        np.savez(tmp_path / "directions.npz", directions=directions)
    with pytest.raises(CalibrationError, match="holds no directions of lights"):
        GivenLights.load(tmp_path)


def test_slopes_of_a_bump_rise_towards_its_centre() -> None:
    names = tuple("abcdef")
    y, x = np.mgrid[:41, :41] - 20.0
    normal = np.dstack([x, y, np.full_like(x, 40.0)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    frame = Frame((200 * normal @ LIGHTS.T).astype(np.float32), names, 0.1)
    even = Reference(np.full(frame.pixels.shape, 255, np.float32), names)
    measured = GivenLights(LIGHTS).measure(frame, even)
    assert measured.x == pytest.approx(-x / 40, abs=1e-3)
    assert measured.y == pytest.approx(-y / 40, abs=1e-3)
    three = Frame(frame.pixels[..., :3], names[:3], 0.1)
    with pytest.raises(CalibrationError, match="6 lights and the frame 3 channels"):
        GivenLights(LIGHTS).measure(three, even)


PROFILE = """\
schema: 1
name: six_given
image: {width_px: 120, height_px: 100, mm_per_px: 0.05, color: grey, transfer: linear}
illumination:
  use: core.sequential
  lights:
""" + "".join(
    f"    - {{name: led{k}, azimuth_deg: {azimuth}, elevation_deg: 60}}\n"
    for k, azimuth in enumerate(AZIMUTHS)
)
PROFILE += """\
calibration: {use: desktop_six_led.photometric_stereo, lights: given}
estimators: {height: {use: core.poisson, shadow_share: 0}}
"""
PEAK_MM = 0.5


def hill() -> NDArray[np.float64]:
    """(H, W) height in mm of a smooth bump towards the camera."""
    y, x = np.mgrid[:100, :120] - np.array([52.0, 60.0]).reshape(2, 1, 1)
    return np.asarray(PEAK_MM * np.exp(-(x**2 + y**2) / (2 * 15.0**2)))


def exposures(height_mm: NDArray[np.float64], strengths: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(H, W, 6) of a Lambertian surface."""
    gy, gx = np.gradient(height_mm, 0.05)
    normal = np.dstack([-gx, -gy, np.ones_like(gx)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.rint(200 * strengths * np.maximum(normal @ LIGHTS.T, 0)).astype(np.uint8)


def slope_error_deg(x: NDArray[np.float32], y: NDArray[np.float32]) -> float:
    gy, gx = np.gradient(hill(), 0.05)
    return float(np.degrees(np.arctan(np.hypot(x - gx, y - gy))).mean())


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    path = tmp_path / "six_given.yaml"
    path.write_text(PROFILE)
    return path


def test_a_pipeline_without_a_bundle_uses_the_lights_of_the_profile(profile: Path) -> None:
    pipeline = Pipeline(profile)
    assert any("slopes come from the lights" in note for note in pipeline.notes)
    frame = Frame(exposures(hill(), np.ones(6)), tuple(f"led{k}" for k in range(6)), 0.05)
    reading = pipeline.process(frame)
    assert slope_error_deg(reading[Gradients].x, reading[Gradients].y) < 0.5
    assert reading[HeightMap].mm.max() == pytest.approx(PEAK_MM, rel=0.05)


def test_a_reference_compensates_unequal_strengths_of_the_lights(profile: Path) -> None:
    unequal = np.array([1.0, 0.8, 1.1, 0.7, 0.9, 1.0])
    names = tuple(f"led{k}" for k in range(6))
    frame = Frame(exposures(hill(), unequal), names, 0.05)
    level = exposures(np.zeros_like(hill()), unequal).astype(np.float32)
    reading = Pipeline(profile, reference=Reference(level, names)).process(frame)
    assert slope_error_deg(reading[Gradients].x, reading[Gradients].y) < 0.5
    without = Pipeline(profile).process(frame)
    assert slope_error_deg(without[Gradients].x, without[Gradients].y) > 5


def test_the_command_line_measures_without_a_bundle(profile: Path, tmp_path: Path) -> None:
    (tmp_path / "hill").mkdir()
    for k, exposure in enumerate(exposures(hill(), np.ones(6)).transpose(2, 0, 1)):
        cv2.imwrite(str(tmp_path / "hill" / f"{k}.png"), exposure)
    done = tactile("run", profile, "--input", tmp_path / "hill", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "slopes come from the lights as the profile gives them" in done.stderr
    with np.load(tmp_path / "out" / "hill.npz") as data:
        assert slope_error_deg(*data["gradients"].transpose(2, 0, 1)) < 0.5
        assert data["height_mm"].max() == pytest.approx(PEAK_MM, rel=0.05)


def test_learned_lights_need_a_bundle(profile: Path) -> None:
    profile.write_text(PROFILE.replace("lights: given", "lights: learned"))
    pipeline = Pipeline(profile)
    assert any("no bundle, so these steps are left out: height" in note for note in pipeline.notes)
