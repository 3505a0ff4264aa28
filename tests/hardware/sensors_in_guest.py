"""A GelSight Mini and two DIGITs with the kernel's own drivers, by the profiles of their names."""

from __future__ import annotations

import json
import os
import sys
import time
from collections import deque
from collections.abc import Iterator
from functools import partial
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pytest
from hardware.plugged import (
    CAMERA,
    CORNER_PX,
    DIGITS,
    MINI,
    PLUGS,
    PROCESSING,
    SENSORS,
    WEBCAMS,
    ZOOM,
    number_of,
    step_between,
)
from hardware.usbip_bus import Bus, wait_for, webcams_are_there
from support.command_line import tactile

from tactile_core import Sensor, open_sensor
from tactile_core.builtin.cameras.uvc_camera import UvcCamera
from tactile_core.errors import CameraLost, DeviceError
from tactile_core.interfaces.streaming import encoded_image
from tactile_core.testing.imports import Footprint

READINGS = int(os.environ.get("TACTILE_READINGS", "90"))
MEASURED = 5
PATIENCE_S = 20.0
ALL_LIGHTS = 0xFFF


@pytest.fixture
def sensors(bus: Bus) -> Iterator[Bus]:
    """The bus with the webcams and the sensors, whose lights are off."""
    for serial in SENSORS:
        bus.ask(serial, "power")
        bus.plug(PLUGS[serial])
    wait_for(partial(webcams_are_there, SENSORS))
    yield bus
    for serial in SENSORS:
        if bus.is_plugged(PLUGS[serial]):
            bus.unplug(PLUGS[serial])
    wait_for(webcams_are_there)


def opened(profile: str, serial: str, **options: float) -> Sensor:
    return open_sensor(profile, serial=serial, reference="first", timeout_s=PATIENCE_S, **options)


def lights_of(bus: Bus, serial: str) -> object:
    """Return what a DIGIT's zoom was set to."""
    return bus.ask(serial, "control", CAMERA, ZOOM)


def corner(pixels: np.ndarray) -> np.ndarray:
    """Return the part of an upright image of a DIGIT that shows its number."""
    return pixels[-CORNER_PX:, :CORNER_PX]


def test_each_is_listed_with_its_model_and_serial_number(sensors: Bus) -> None:
    assert len(list(Path("/sys/class/video4linux").iterdir())) == 2 * len((*WEBCAMS, *SENSORS))
    listed = json.loads(tactile("devices", "--json").stdout)["devices"]
    cameras = {one["serial"]: one for one in listed if one["serial"] in SENSORS}
    assert set(cameras) == set(SENSORS)
    for serial, one in cameras.items():
        mini = serial == MINI
        assert one["usb_id"] == ("0c45:636d" if mini else "2833:0209")
        assert one["product"] == ("GelSight Mini R0B 2BNN-4ZE7" if mini else "DIGIT")
        assert ("gelsight_mini" if mini else "digit") in one["profiles"]
    table = tactile("devices").stdout.splitlines()
    assert all(any(serial in line for line in table) for serial in SENSORS)


def test_a_digit_by_its_profile_gives_its_images_at_30_hz(sensors: Bus) -> None:
    before = Footprint.take_snapshot()
    with opened("digit", DIGITS[0]) as sensor:
        assert sensor.camera.device_id == DIGITS[0]
        sensor.read()  # which loads code
        # an emulated processor measures ten a second or so, and the claim is about acquisition
        sensor.camera.set_drop("never")
        frames = list(islice(iter(sensor.acquire, None), READINGS))
        began_s = time.monotonic()
        readings = [sensor.read() for _ in range(MEASURED)]
        took_s = time.monotonic() - began_s
        statistics = sensor.camera.statistics
    times_s = np.array([frame.timestamp_s for frame in frames])
    sent, skipped = sensors.ask(DIGITS[0], "sent")  # type: ignore[misc]
    print(
        f"{READINGS} images of {frames[0].pixels.shape} at {(READINGS - 1) / np.ptp(times_s):.2f} "
        f"Hz, {MEASURED / took_s:.2f} readings a second; the camera sent {sent} and left {skipped} "
        f"out because the bus was too slow; {statistics}",
        file=sys.stderr,
    )
    assert {frame.pixels.shape for frame in frames} == {(320, 240, 3)}
    steps = np.array(
        [step_between(corner(a.pixels), corner(b.pixels)) for a, b in pairwise(frames)]
    )
    assert np.mean(steps[1:] == 1) >= 0.98  # an emulated processor may keep the driver waiting
    assert np.median(np.diff(times_s)) == pytest.approx(1 / 30, rel=0.1)
    assert (statistics.torn, statistics.repeated) == (0, 0)
    assert len(readings) == MEASURED
    assert before.find_leaks() == ""


@pytest.mark.parametrize(
    ("width", "height", "fps"), [(320, 240, 30), (320, 240, 60), (640, 480, 15), (640, 480, 30)]
)
def test_a_digit_opens_in_each_of_its_modes_and_sends_images_in_order(
    sensors: Bus, width: int, height: int, fps: int
) -> None:
    options = {"serial": DIGITS[0], "width_px": width, "height_px": height, "fps": fps}
    camera = UvcCamera(UvcCamera.Options.model_validate({**options, "format": "YUYV"}))
    camera.set_drop("never")
    with camera:
        notes = camera.notes
        images = [camera.read(PATIENCE_S) for _ in range(READINGS)]
    pixels = [image.pixels[:CORNER_PX, :CORNER_PX] for image in images if image is not None]
    times_s = [image.timestamp_s for image in images if image is not None]
    sent, skipped = sensors.ask(DIGITS[0], "sent")  # type: ignore[misc]
    print(
        f"{width} × {height} at {fps} Hz: {(READINGS - 1) / np.ptp(times_s):.2f} Hz; the camera "
        f"sent {sent} and left {skipped} out because the bus was too slow",
        file=sys.stderr,
    )
    assert f"{width} × {height} pixels, {fps} images a second, YUYV" in notes[0]
    # an emulated processor is too slow for most modes, so that the driver leaves images out
    assert {step_between(a, b) for a, b in pairwise(pixels)} <= set(range(1, 32))


def test_the_lights_of_a_digit_are_on_while_its_sensor_is_open(sensors: Bus) -> None:
    assert lights_of(sensors, DIGITS[0]) == 0
    with opened("digit", DIGITS[0]) as sensor:
        assert sensor.read() is not None
        assert lights_of(sensors, DIGITS[0]) == ALL_LIGHTS
        camera = sensor.camera
        assert isinstance(camera, UvcCamera)
        # 12 bits arrive, and at most 8 are reported
        assert camera.set_control("zoom", 0xF30) == 0xFF
        assert lights_of(sensors, DIGITS[0]) == 0xF30
    assert lights_of(sensors, DIGITS[0]) == 0


def test_two_digits_are_chosen_by_serial_number_and_have_lights_of_their_own(sensors: Bus) -> None:
    with pytest.raises(DeviceError, match=f"2 cameras match.*{DIGITS[0]}.*{DIGITS[1]}"):
        open_sensor("digit", reference="first")
    with opened("digit", DIGITS[0]) as first:
        with opened("digit", DIGITS[1]) as second:
            assert [one.camera.device_id for one in (first, second)] == list(DIGITS)
            assert [lights_of(sensors, serial) for serial in DIGITS] == [ALL_LIGHTS] * 2
            for _ in range(3):
                assert first.read().frame.pixels.shape == second.read().frame.pixels.shape
        assert [lights_of(sensors, serial) for serial in DIGITS] == [ALL_LIGHTS, 0]
        assert first.read() is not None


def test_a_digit_that_was_unplugged_goes_on_with_its_lights(sensors: Bus) -> None:
    with opened("digit", DIGITS[0], reconnect_s=2 * PATIENCE_S) as sensor:
        sensor.read()
        sensors.unplug(PLUGS[DIGITS[0]])
        sensors.ask(DIGITS[0], "power")
        assert lights_of(sensors, DIGITS[0]) == 0
        sensors.plug(PLUGS[DIGITS[0]])
        warnings = [warning for _ in range(30) for warning in sensor.read().warnings]
        assert warnings
        assert lights_of(sensors, DIGITS[0]) == ALL_LIGHTS


def test_a_mini_that_was_unplugged_is_lost_and_opens_again(sensors: Bus) -> None:
    with opened("gelsight_mini", MINI) as sensor:
        sensor.read()
        sensors.unplug(PLUGS[MINI])
        with pytest.raises(CameraLost, match="was unplugged; connect it again"):
            deque(sensor.stream(), maxlen=0)
    sensors.plug(PLUGS[MINI])
    wait_for(partial(webcams_are_there, SENSORS))
    with opened("gelsight_mini", MINI) as sensor:
        assert sensor.read() is not None


def test_a_mini_by_its_profile_is_locked_and_measures_the_crop(sensors: Bus) -> None:
    with opened("gelsight_mini", MINI) as sensor:
        reading = sensor.read()
        assert sensor.camera.device_id == MINI
        assert any("3280 × 2464 pixels, 25 images a second, MJPG" in note for note in sensor.notes)
        controls = {(CAMERA, 2): 1, (CAMERA, 4): 180, (PROCESSING, 4): 0, (PROCESSING, 0x0A): 4500}
        for (unit, selector), value in controls.items():
            assert sensors.ask(MINI, "control", unit, selector) == value
    assert reading.frame.pixels.shape == (240, 320, 3)
    assert reading.frame.pixels.min() > 0  # beyond the gel, the emulated image is black


def test_each_image_of_a_mini_arrives_in_order(
    sensors: Bus, monkeypatch: pytest.MonkeyPatch
) -> None:
    # decoding takes longer than a period, and the claim is about acquisition
    monkeypatch.setattr(encoded_image, "decode_image", lambda *_: np.zeros((1, 1, 3), np.uint8))
    options = {"serial": MINI, "width_px": 3280, "height_px": 2464, "fps": 25}
    camera = UvcCamera(UvcCamera.Options.model_validate(options))
    camera.set_drop("never")
    with camera:
        images = [camera.read(PATIENCE_S) for _ in range(READINGS)]
        statistics = camera.statistics
    encoded = [image.encoded or b"" for image in images if image is not None]
    times_s = np.array([image.timestamp_s for image in images if image is not None])
    sent, skipped = sensors.ask(MINI, "sent")  # type: ignore[misc]
    print(
        f"{READINGS} images of {np.mean([*map(len, encoded)]) / 1e3:.0f} kB at "
        f"{(READINGS - 1) / np.ptp(times_s):.2f} Hz; the camera sent {sent} and left {skipped} out "
        f"because the bus was too slow; {statistics}",
        file=sys.stderr,
    )
    np.testing.assert_array_equal(np.diff([number_of(jpeg) for jpeg in encoded]), 1)
    assert (statistics.dropped, statistics.torn, statistics.repeated) == (0, 0, 0)
