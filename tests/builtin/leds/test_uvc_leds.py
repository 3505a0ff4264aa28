"""Lights on a control of the camera."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.builtin.leds.serial_leds import UvcLeds
from tactile_core.errors import DeviceError
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import Options
from tactile_core.quantities import Image

RGB = ("red", "green", "blue")


class Plain(Camera):
    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _read(self, timeout_s: float) -> Image:
        return Image(np.zeros((4, 4), np.uint8))


class Digit(Plain):
    """Takes a zoom of 12 bits at most."""

    def __init__(self) -> None:
        super().__init__(Options())
        self.zooms: list[int] = []

    def set_control(self, name: str, value: int) -> int:
        self._require_open()
        if name != "zoom":
            raise DeviceError(f"the camera has no control {name!r}")
        self.zooms.append(min(value, 0xFFF))
        return self.zooms[-1]


def leds(camera: Camera, **options: object) -> UvcLeds:
    driver = UvcLeds(UvcLeds.Options.model_validate({"lights": RGB, **options}))
    driver.attach(camera)
    return driver


def test_the_levels_are_digits_of_one_number() -> None:
    camera = Digit()
    with camera, leds(camera) as driver:
        driver.set({"red": 1.0, "blue": 0.2})
        driver.set({"green": 0.01})
    assert camera.zooms == [0xF03, 0x010, 0]


def test_the_lights_may_be_closed_after_their_camera() -> None:
    camera = Digit()
    driver = leds(camera).open()
    with camera:
        driver.set({"red": 1.0})
        driver.set({})
    driver.close()
    assert camera.zooms == [0xF00, 0]


def test_a_closed_camera_cannot_light() -> None:
    with leds(Digit()) as driver, pytest.raises(DeviceError, match="Digit is closed"):
        driver.set({"red": 1.0})


def test_a_camera_without_controls_is_refused() -> None:
    with pytest.raises(DeviceError, match="through a control of the camera, but Plain has none"):
        leds(Plain(Options()))


class Clamped(Digit):
    """Takes every value, and reports no more than 255."""

    def set_control(self, name: str, value: int) -> int:
        return min(super().set_control(name, value), 0xFF)


def test_a_camera_may_report_another_value_than_it_took() -> None:
    camera = Clamped()
    with camera, leds(camera) as driver:
        driver.set(dict.fromkeys(RGB, 1.0))
    assert camera.zooms == [0xFFF, 0]


def test_an_unknown_light_is_named() -> None:
    camera = Digit()
    with camera, leds(camera) as driver, pytest.raises(DeviceError, match="has no light 'white'"):
        driver.set({"white": 1.0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"lights": ("a", "a")}, "two lights have the same name"),
        ({"lights": tuple("abcdefgh")}, "8 lights of 4 bits do not fit"),
    ],
)
def test_unusable_options_are_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        UvcLeds.Options.model_validate(given)


def test_a_driver_without_a_camera_is_refused() -> None:
    expected = pytest.raises(DeviceError, match="has no camera; attach")
    with UvcLeds(UvcLeds.Options(lights=RGB)) as driver, expected:
        driver.set({"red": 1.0})


def test_the_lights_of_a_killed_program_stay_on() -> None:
    assert leds(Digit()).watchdog_s is None
