import json
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from support.command_line import tactile

from tactile_core.acquisition.acquisition import Acquisition
from tactile_core.acquisition.devices import make_devices
from tactile_core.acquisition.geometry import ImageGeometry
from tactile_core.interfaces.camera import Camera
from tactile_core.interfaces.device import ConnectedDevice, Options
from tactile_core.plugins.registry import resolve
from tactile_core.profiles.loader import load_profile
from tactile_core.quantities import Image

DIGIT = load_profile("digit")


class EmulatedDigit(Camera):
    """A DIGIT as its users describe it: it takes every zoom, and reports no more than 255."""

    def __init__(self) -> None:
        super().__init__(Options())
        self.received: list[object] = []
        self._numbers: Iterator[int] = iter(range(100))

    def set_control(self, name: str, value: int) -> int:
        self._require_open()
        self.received.append((name, value))
        return min(value, 255)

    def _open(self) -> None:
        self.received.append("opened")

    def _close(self) -> None:
        """Nothing to release."""

    def _read(self, timeout_s: float) -> Image:
        size = DIGIT.camera.options["height_px"], DIGIT.camera.options["width_px"]
        return Image(np.full((*size, 3), 90, np.uint8), sequence=next(self._numbers))


def test_a_digit_is_found_by_what_it_is() -> None:
    selectors = resolve("camera", DIGIT.camera.use).selectors
    digit = ConnectedDevice("/dev/video0", "DIGIT", "2833:0209", "D20123")
    other = ConnectedDevice("/dev/video2", "HD Webcam C310", "046d:081b")
    assert digit.fits(DIGIT.camera.options, selectors)
    assert not other.fits(DIGIT.camera.options, selectors)


def test_the_image_is_turned_as_other_programs_turn_it() -> None:
    sent = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    expected = cv2.flip(cv2.transpose(sent), 0)
    np.testing.assert_array_equal(ImageGeometry(DIGIT.image).apply(sent), expected)


def test_the_scale_is_one_of_those_that_are_published() -> None:
    assert 17.15 <= 1 / DIGIT.image.mm_per_px <= 21.1


def test_all_leds_are_on_at_full_brightness_while_frames_arrive_and_off_afterwards() -> None:
    made = make_devices(DIGIT)
    assert made.driver is not None
    camera = EmulatedDigit()
    made.driver.attach(camera)
    with camera, made.driver:
        acquisition = Acquisition(camera, made.illumination, DIGIT.image, made.driver)
        frames = [acquisition.observe(1.0) for _ in range(5)]
    assert {frame.pixels.shape for frame in frames if frame is not None} == {(320, 240, 3)}
    # neither the mode of the camera nor the lights change while it streams
    assert camera.received == ["opened", ("zoom", 0xFFF), ("zoom", 0)]


@pytest.mark.parametrize(
    ("levels", "zoom"),
    [({"red": 1.0}, 0xF00), ({"green": 1.0}, 0x0F0), ({"blue": 1.0, "red": 0.2}, 0x30F)],
)
def test_each_led_has_four_bits_of_the_zoom(levels: dict[str, float], zoom: int) -> None:
    driver = make_devices(DIGIT).driver
    assert driver is not None
    camera = EmulatedDigit()
    driver.attach(camera)
    with camera, driver:
        driver.set(levels)
    assert ("zoom", zoom) in camera.received


@pytest.mark.parametrize("name", ["digit", "digit_sequential"])
def test_the_virtual_digit_needs_no_device(name: str) -> None:
    done = tactile("run", name, "--sim", "--frames", 3, "--json")
    assert done.returncode == 0, done.stderr
    assert [json.loads(line)["sequence"] for line in done.stdout.splitlines()] == [0, 1, 2]
