"""Boxes of LEDs on USB: pyusb over the wire of USB/IP."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("usbip", reason="'pip install usbip==0.7.0' emulates USB devices")

from support.light_box import LIGHTS
from support.usb_light_box import UsbLightBox
from support.usbip_backend import UsbipBackend

from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.errors import DeviceError
from tactile_core.testing.imports import Footprint

DARK = [0] * 6


@pytest.fixture
def boxes() -> tuple[UsbLightBox, UsbLightBox]:
    return UsbLightBox("L0001", port=2), UsbLightBox("L0002", port=3)


@pytest.fixture
def bus(
    boxes: tuple[UsbLightBox, UsbLightBox], monkeypatch: pytest.MonkeyPatch
) -> Iterator[UsbipBackend]:
    bus = UsbipBackend(UsbLightBox(product="USBasp", port=1), *boxes)
    monkeypatch.setattr(UsbLeds, "backend", bus)
    yield bus
    bus.close()


def leds(**options: Any) -> UsbLeds:
    return UsbLeds(UsbLeds.Options(lights=LIGHTS, **options))


def test_among_three_devices_the_serial_selects(
    bus: UsbipBackend, boxes: tuple[UsbLightBox, UsbLightBox]
) -> None:
    with leds(serial="L0002") as driver:
        driver.set({"led2": 1.0, "led6": 0.5})
        assert driver.info is not None
        assert driver.info.serial == "L0002"
    assert boxes[1].levels == [DARK, [0, 255, 0, 0, 0, 128], DARK]
    assert boxes[0].levels == []


def test_two_without_a_serial_are_listed(bus: UsbipBackend) -> None:
    with pytest.raises(DeviceError, match=r"L0001 \(port path 1-2\), L0002 \(port path 1-3\); nam"):
        leds().open()


def test_a_refused_request_is_an_error(
    bus: UsbipBackend, boxes: tuple[UsbLightBox, UsbLightBox]
) -> None:
    with leds(serial="L0001") as driver:
        boxes[0].stalls = True
        with pytest.raises(DeviceError, match="refuses a request; load the firmware"):
            driver.set({"led1": 1.0})


def test_a_silent_box_is_an_error(bus: UsbipBackend) -> None:
    driver = leds(serial="L0001", timeout_s=0.2).open()
    bus.plugged[1].loud.clear()
    with pytest.raises(DeviceError, match=r"USB 1-2 does not answer within 0\.2 s"):
        driver.set({"led1": 1.0})
    driver.close()


def test_an_unplugged_box_opens_again_once_it_is_back(
    bus: UsbipBackend, boxes: tuple[UsbLightBox, UsbLightBox]
) -> None:
    driver = leds(serial="L0001").open()
    bus.unplug(boxes[0])
    with pytest.raises(DeviceError, match="was disconnected; plug it in and open the sensor"):
        driver.set({"led1": 1.0})
    driver.close()
    with pytest.raises(DeviceError, match=r"serial number L0001 and .* is connected; plug it in"):
        driver.open()
    bus.plugged += UsbipBackend(boxes[0]).plugged
    with driver:
        driver.set({"led1": 1.0})
    assert boxes[0].levels[-1] == DARK


def test_opening_again_leaves_nothing(bus: UsbipBackend) -> None:
    with leds(serial="L0001"):
        pass
    before = Footprint.take_snapshot()
    for _ in range(3):
        with leds(serial="L0001") as driver:
            driver.set({"led1": 1.0})
    assert before.find_leaks() == ""
