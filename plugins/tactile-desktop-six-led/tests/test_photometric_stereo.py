"""Six sequential lights, rendered with a given response, albedo and light field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from support.gains import MOST, gains
from support.normals import to_gradient

from tactile_core.errors import CalibrationError
from tactile_core.interfaces.calibration import Press
from tactile_core.plugins.registry import resolve
from tactile_core.quantities import Frame, Gradients, Reference
from tactile_desktop_six_led.light_fit import fit_light_field
from tactile_desktop_six_led.photometric_stereo import (
    PhotometricCalibrator,
    PhotometricStereo,
    StereoOptions,
)

SHAPE = (120, 160)

BALL_PX = 22.0

CENTRES = [(x, y) for y in (30.0, 60.0, 90.0) for x in (30.0, 80.0, 130.0)]


@dataclass(frozen=True)
class Rig:
    """Lights near the gel, whose directions vary over it, with a concave response."""

    azimuths_deg: tuple[float, ...] = (-90, -150, 150, 90, 30, -30)
    gamma: float = 0.8

    def frame(
        self,
        slopes: NDArray[np.float64],
        *,
        gain: NDArray[np.float64] | float = 1.0,
        albedo: NDArray[np.float64] | float = 1.0,
        full_scale: float = 255.0,
        seed: int | None = None,
    ) -> Frame:
        """Render (H, W, 2) slopes."""
        normal = np.dstack([-slopes, np.ones(SHAPE)])
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(float)
        planes = []
        for azimuth in np.radians(self.azimuths_deg):
            light = 300 * np.array([np.cos(azimuth), np.sin(azimuth)])
            to_light = np.dstack([light[0] + 80 - x, light[1] + 60 - y, np.full(SHAPE, 600.0)])
            to_light /= np.linalg.norm(to_light, axis=2, keepdims=True)
            planes.append(np.maximum((normal * to_light).sum(2), 0.02))
        light = (np.stack(planes, 2) * np.asarray(albedo)[..., None]) ** self.gamma
        level = 0.75 * full_scale * light * gain
        if seed is not None:
            noise = np.random.default_rng(seed).normal(0, 0.004 * full_scale, level.shape)
            level = level + noise
        dtype = np.uint8 if full_scale == 255 else np.uint16
        pixels = np.clip(np.rint(level), 0, full_scale).astype(dtype)
        names = tuple(f"led{k}" for k in range(pixels.shape[2]))
        return Frame(pixels, names, 0.01, full_scale=full_scale)

    def reference(self, full_scale: float = 255.0) -> Reference:
        frame = self.frame(np.zeros((*SHAPE, 2)), full_scale=full_scale)
        return Reference(frame.pixels.astype(np.float32), frame.channels, full_scale=full_scale)

    def press(self, centre: tuple[float, float], full_scale: float = 255.0, seed: int = 0) -> Press:
        slopes, on_ball = ball(centre)
        frame = self.frame(slopes, full_scale=full_scale, seed=seed)
        rows, columns = np.nonzero(on_ball)
        return Press(
            frame,
            rows.astype(np.int32),
            columns.astype(np.int32),
            slopes[on_ball].astype(np.float32),
        )

    def presses(self, full_scale: float = 255.0) -> list[Press]:
        return [self.press(centre, full_scale, seed) for seed, centre in enumerate(CENTRES)]


def ball(
    centre: tuple[float, float], reach: float = 0.85
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(H, W, 2) slopes of a ball, and its (H, W) bool contact area."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    normal_xy = np.dstack([centre[0] - x, centre[1] - y]) / BALL_PX
    radius = np.hypot(normal_xy[..., 0], normal_xy[..., 1])
    normal_xy[radius >= reach] = 0
    return to_gradient(normal_xy.astype(np.float32)).astype(np.float64), radius < reach


def error_deg(measured: Gradients, slopes: NDArray[np.float64], where: NDArray[np.bool_]) -> float:
    a = np.dstack([measured.x, measured.y, np.ones(SHAPE)])[where]
    b = np.dstack([slopes, np.ones(SHAPE)])[where]
    cosine = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


@pytest.fixture(scope="module")
def fitted(rig: Rig) -> PhotometricStereo:
    return fit(rig.presses(), rig.reference())


def fit(presses: list[Press], reference: Reference, **options: float) -> PhotometricStereo:
    settings = StereoOptions.model_validate({"blur_px": 0, **options})
    return PhotometricCalibrator(settings).fit(presses, reference)


SPOT = (100.0, 52.0)


def test_calibrator_and_model_have_the_same_name() -> None:
    name = "desktop_six_led.photometric_stereo"
    assert resolve("calibrator", name) is PhotometricCalibrator
    assert resolve("artefact", name) is PhotometricStereo


def test_a_held_out_ball_is_measured_within_a_degree(rig: Rig, fitted: PhotometricStereo) -> None:
    slopes, on_ball = ball(SPOT)
    measured = fitted.measure(rig.frame(slopes, seed=99), rig.reference())
    assert error_deg(measured, slopes, on_ball) < 1.0
    assert error_deg(measured, slopes, ~on_ball) < 0.7


@pytest.mark.parametrize("centre", [SPOT, (60.0, 70.0)])
def test_slopes_are_neither_steeper_nor_flatter_than_the_ball(
    rig: Rig, fitted: PhotometricStereo, centre: tuple[float, float]
) -> None:
    slopes, on_ball = ball(centre)
    measured = fitted.measure(rig.frame(slopes, seed=98), rig.reference())
    found = np.stack([measured.x, measured.y], -1)[on_ball]
    assert gains(found, slopes[on_ball]) == pytest.approx(1, abs=MOST)


def test_the_model_extrapolates_to_steeper_slopes(rig: Rig) -> None:
    shallow = []
    for press in rig.presses():
        gentle = np.hypot(press.gradients[:, 0], press.gradients[:, 1]) < np.tan(np.radians(35))
        shallow.append(
            replace(
                press,
                rows=press.rows[gentle],
                columns=press.columns[gentle],
                gradients=press.gradients[gentle],
            )
        )
    slopes, on_ball = ball(SPOT)
    steep = on_ball & (np.hypot(slopes[..., 0], slopes[..., 1]) > np.tan(np.radians(45)))
    measured = fit(shallow, rig.reference()).measure(rig.frame(slopes), rig.reference())
    assert error_deg(measured, slopes, steep) < 3.0


def test_albedo_and_common_brightness_have_little_influence(
    rig: Rig, fitted: PhotometricStereo
) -> None:
    slopes, on_ball = ball(SPOT)
    plain = error_deg(fitted.measure(rig.frame(slopes), rig.reference()), slopes, on_ball)
    for changed in (rig.frame(slopes, gain=1.03), rig.frame(slopes, albedo=0.95)):
        measured = fitted.measure(changed, rig.reference())
        assert error_deg(measured, slopes, on_ball) < plain + 0.1


@pytest.mark.parametrize("light", range(6))
@pytest.mark.parametrize("level", [10, 250], ids=["cast shadow", "highlight"])
def test_shadows_and_highlights_of_one_light_are_rejected(
    rig: Rig, fitted: PhotometricStereo, light: int, level: int
) -> None:
    slopes, _ = ball(SPOT)
    frame = rig.frame(slopes)
    pixels = frame.pixels.copy()
    patch = np.zeros(SHAPE, np.bool_)
    patch[35:75, 85:120] = True
    pixels[patch, light] = level
    measured = fitted.measure(replace(frame, pixels=pixels), rig.reference())
    assert error_deg(measured, slopes, patch) < 1.5
    assert measured.valid[patch].mean() > 0.95


def test_with_four_lights_an_outlier_is_detected_but_not_replaced() -> None:
    four = Rig((0, 90, 180, 270))
    fitted = fit(four.presses(), four.reference())
    frame = four.frame(np.zeros((*SHAPE, 2)))
    pixels = frame.pixels.copy()
    pixels[20:60, 20:60, 0] = 10
    measured = fitted.measure(replace(frame, pixels=pixels), four.reference())
    assert not measured.valid[25:55, 25:55].any()
    assert measured.valid[70:].all()


def test_three_lights_are_enough_and_two_are_not() -> None:
    slopes, on_ball = ball(SPOT)
    three = Rig((0, 120, 240))
    fitted = fit(three.presses(), three.reference())
    measured = fitted.measure(three.frame(slopes), three.reference())
    assert error_deg(measured, slopes, on_ball) < 1.5
    two = Rig((0, 120))
    with pytest.raises(CalibrationError, match="needs 3 lights and there are 2"):
        fit(two.presses(), two.reference())


def test_images_are_measured_like_single_pixels(rig: Rig, fitted: PhotometricStereo) -> None:
    press = rig.press(SPOT)
    measured = fitted.measure(press.frame, rig.reference())
    change = press.frame.pixels[press.rows, press.columns].astype(np.float32)
    change = change / rig.reference().pixels[press.rows, press.columns] - 1
    height, width = SHAPE
    position = np.stack([press.columns - (width - 1) / 2, press.rows - (height - 1) / 2], 1)
    features = np.concatenate([change, position / (width / 2)], 1).astype(np.float32)
    expected = to_gradient(fitted._model.field(features))
    found = np.stack([measured.x, measured.y], 2)[press.rows, press.columns]
    assert np.abs(found - expected).mean() < 0.01


def test_planar_pixels_and_sixteen_bits_give_the_same_slopes(
    rig: Rig, fitted: PhotometricStereo
) -> None:
    slopes, _ = ball(SPOT)
    frame = rig.frame(slopes)
    first = fitted.measure(frame, rig.reference())
    planar = np.ascontiguousarray(frame.pixels.transpose(2, 0, 1)).transpose(1, 2, 0)
    again = fitted.measure(replace(frame, pixels=planar), rig.reference())
    assert np.array_equal(first.x, again.x)
    deep = replace(frame, pixels=frame.pixels.astype(np.uint16) * 257, full_scale=65535.0)
    reference = rig.reference()
    reference = replace(reference, pixels=reference.pixels * 257, full_scale=65535.0)
    sixteen = fitted.measure(deep, reference)
    assert np.abs(sixteen.x - first.x).max() < 1e-3


def test_a_loaded_model_measures_the_same(
    rig: Rig, fitted: PhotometricStereo, tmp_path: Path
) -> None:
    fitted.save(tmp_path)
    again = PhotometricStereo.load(tmp_path)
    frame = rig.press(SPOT).frame
    before, after = (model.measure(frame, rig.reference()) for model in (fitted, again))
    assert np.array_equal(before.x, after.x)
    assert np.array_equal(before.valid, after.valid)


def test_the_response_of_the_lights_is_learned(rig: Rig) -> None:
    rng = np.random.default_rng(0)
    slopes = rng.uniform(-0.8, 0.8, (3000, 2))
    normal = np.concatenate([-slopes, np.ones((3000, 1))], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    azimuths = np.radians(rig.azimuths_deg)
    lights = np.stack([np.cos(azimuths), np.sin(azimuths), np.full(6, 1.8)]) / np.hypot(1, 1.8)
    light = (normal @ lights) ** rig.gamma
    change = light / lights[2] ** rig.gamma - 1
    features = np.concatenate([change, rng.uniform(-1, 1, (3000, 2))], 1).astype(np.float32)
    field, _ = fit_light_field(features, (-normal[:, :2]).astype(np.float32))
    assert field(features) == pytest.approx(-normal[:, :2], abs=0.01)


def test_the_change_of_light_by_a_press_tilts_no_gel(rig: Rig, fitted: PhotometricStereo) -> None:
    # each light changes by up to 3 % under a press, more on one side
    side = np.linspace(0.2, 1, SHAPE[1])[None, :, None]
    change = 1 + 0.03 * side * np.array([1, 0.5, -0.5, -1, -0.5, 0.5])
    presses = []
    for seed, press in enumerate(rig.presses()):
        slopes, _ = ball(CENTRES[seed])
        presses.append(replace(press, frame=rig.frame(slopes, gain=change, seed=seed)))
    changed = fit(presses, rig.reference())
    slopes, on_ball = ball(SPOT)
    measured = changed.measure(rig.frame(slopes, gain=change), rig.reference())
    steady = fitted.measure(rig.frame(slopes), rig.reference())
    without = fitted.measure(rig.frame(slopes, gain=change), rig.reference())
    least, error, most = (error_deg(m, slopes, on_ball) for m in (steady, measured, without))
    assert error - least < 0.1 * (most - least)
    level = changed.measure(rig.frame(np.zeros((*SHAPE, 2))), rig.reference())
    # rounding to grey levels averages out, a tilt does not
    assert max(np.abs(cv2.blur(plane, (31, 31))).max() for plane in (level.x, level.y)) < 1e-3


def test_the_grain_of_the_reference_does_not_add_to_that_of_a_press(rig: Rig) -> None:
    # the gel moves under a press, so that its grain is another one than in the reference
    rng = np.random.default_rng(3)
    slopes, on_ball = ball(SPOT)
    grain = [1 + 0.02 * rng.standard_normal((*SHAPE, 6)) for _ in range(2)]
    frame = rig.frame(slopes, gain=grain[0])
    level = rig.frame(np.zeros((*SHAPE, 2)), gain=grain[1])
    reference = Reference(level.pixels.astype(np.float32), level.channels)
    presses = [rig.press(centre, seed=seed) for seed, centre in enumerate(CENTRES)]
    smooth, rough = (fit(presses, rig.reference(), light_blur_mm=mm) for mm in (0.11, 0.0))
    errors = [error_deg(m.measure(frame, reference), slopes, on_ball) for m in (smooth, rough)]
    assert errors[0] < 0.8 * errors[1]
