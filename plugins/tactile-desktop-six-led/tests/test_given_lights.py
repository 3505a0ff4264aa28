"""Lamps whose directions are given, on a Lambertian ball with shadows and highlights."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tactile_core.errors import CalibrationError
from tactile_core.quantities import Frame, Reference
from tactile_desktop_six_led.given_lights import GivenLights, lamp_directions, robust_normals
from tactile_desktop_six_led.photometric_stereo import PhotometricStereo

AZIMUTHS = [-90.0, -150.0, 150.0, 90.0, 30.0, -30.0]
LAMPS = lamp_directions(AZIMUTHS, [60.0] * 6)


def normals_of_a_ball(count: int = 2000) -> NDArray[np.float32]:
    rng = np.random.default_rng(0)
    sines = rng.uniform(-0.6, 0.6, (count, 2))
    return np.column_stack([sines, np.sqrt(1 - (sines**2).sum(1))]).astype(np.float32)


def off_deg(found: NDArray[np.float32], true: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.degrees(np.arccos(np.clip((found * true).sum(1), -1, 1)))


def test_a_lamp_at_the_right_of_the_image_shines_from_there() -> None:
    assert lamp_directions([0.0], [0.0])[0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert lamp_directions([90.0], [0.0])[0] == pytest.approx([0, 1, 0], abs=1e-6)


@pytest.mark.parametrize("count", [3, 4, 6])
def test_a_lambertian_ball_of_any_albedo_is_exact(count: int) -> None:
    true = normals_of_a_ball()
    lamps = lamp_directions(np.arange(count) * 360 / count, [60.0] * count)
    albedo = np.random.default_rng(1).uniform(0.2, 1, (len(true), 1)).astype(np.float32)
    assert off_deg(robust_normals(albedo * (true @ lamps.T), lamps), true).max() < 0.1


@pytest.mark.parametrize("level", [0.0, 3.0], ids=["shadow", "highlight"])
def test_a_lamp_that_does_not_fit_is_left_out(level: float) -> None:
    true = normals_of_a_ball()
    light = true @ LAMPS.T
    light[np.arange(len(true)), np.arange(len(true)) % 6] = level
    assert off_deg(robust_normals(light, LAMPS), true).mean() < 0.5


def test_a_profile_may_ask_for_given_lights() -> None:
    options = PhotometricStereo.Options.model_validate({"lights": "given"})
    assert isinstance(PhotometricStereo.from_lights(options, AZIMUTHS, [60.0] * 6), GivenLights)
    learned = PhotometricStereo.Options.model_validate({})
    assert PhotometricStereo.from_lights(learned, AZIMUTHS, [60.0] * 6) is None


def test_an_object_nearer_to_the_camera_has_slopes_uphill_to_its_middle() -> None:
    names = tuple("abcdef")
    y, x = np.mgrid[:41, :41] - 20.0
    normal = np.dstack([x, y, np.full_like(x, 40.0)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    frame = Frame((200 * normal @ LAMPS.T).astype(np.float32), names, 0.1)
    even = Reference(np.full(frame.pixels.shape, 255, np.float32), names)
    measured = GivenLights(LAMPS).measure(frame, even)
    assert measured.x == pytest.approx(-x / 40, abs=1e-3)
    assert measured.y == pytest.approx(-y / 40, abs=1e-3)
    three = Frame(frame.pixels[..., :3], names[:3], 0.1)
    with pytest.raises(CalibrationError, match="6 lights and the frame 3 channels"):
        GivenLights(LAMPS).measure(three, even)
