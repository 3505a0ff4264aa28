"""Boxes of LEDs on USB: pyusb with a backend of emulated boxes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest
import usb.core
from support.light_box import LIGHTS
from support.usb_bus import UsbBus
from support.usb_light_box import UsbLightBox

from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.errors import DeviceBusy, DeviceError
from tactile_core.testing.imports import Footprint

DARK = [0] * 6


@pytest.fixture
def box() -> UsbLightBox:
    return UsbLightBox("L0001", port=2)


@pytest.fixture
def bus(box: UsbLightBox, monkeypatch: pytest.MonkeyPatch) -> Iterator[UsbBus]:
    bus = UsbBus(UsbLightBox(product="USBasp", port=1), box)
    monkeypatch.setattr(UsbLeds, "backend", bus)
    yield bus
    assert bus.opened == 0


def leds(**options: Any) -> UsbLeds:
    return UsbLeds(UsbLeds.Options(lights=LIGHTS, **options))


def test_lights_are_set_together_and_go_out_at_the_end(bus: UsbBus, box: UsbLightBox) -> None:
    with leds() as driver:
        driver.set({"led2": 1.0, "led6": 0.5})
        assert driver.watchdog_s == 0.4
    assert box.levels == [DARK, [0, 255, 0, 0, 0, 128], DARK]


def test_the_box_is_kept_alive(bus: UsbBus, box: UsbLightBox) -> None:
    before = Footprint.take_snapshot()
    with leds() as driver:
        driver.set({"led1": 1.0})
        while box.beats < 2:
            time.sleep(0.01)
        driver.check()
    assert before.find_leaks() == ""


def test_a_light_that_does_not_settle_is_an_error(bus: UsbBus, box: UsbLightBox) -> None:
    with leds(timeout_s=0.05) as driver:
        box.settled = False
        with pytest.raises(DeviceError, match=r"USB 1-2 does not answer within 0\.05 s; check"):
            driver.set({"led1": 1.0})
        box.settled = True
        driver.set({"led1": 1.0})


def test_a_silent_box_is_an_error(bus: UsbBus, box: UsbLightBox) -> None:
    driver = leds().open()
    box.silent = True
    with pytest.raises(DeviceError, match=r"does not answer within 0\.5 s"):
        driver.set({"led1": 1.0})
    driver.close()


def test_an_unplugged_box_is_an_error_and_opens_again(bus: UsbBus, box: UsbLightBox) -> None:
    driver = leds().open()
    box.gone = True
    with pytest.raises(DeviceError, match="was disconnected; plug it in and open the sensor"):
        driver.set({"led1": 1.0})
    driver.close()
    with pytest.raises(DeviceError, match=r"no light box with the USB id 16c0:05dc and a product"):
        driver.open()
    box.gone = False
    driver.open().close()


def test_a_box_that_refuses_is_an_error(bus: UsbBus, box: UsbLightBox) -> None:
    with leds() as driver:
        box.stalls = True
        with pytest.raises(DeviceError, match="refuses a request; load the firmware"):
            driver.set({"led1": 1.0})


@pytest.mark.parametrize("given", [{"serial": "L0002"}, {"port_path": "1-3"}])
def test_among_two_the_options_select(bus: UsbBus, box: UsbLightBox, given: dict[str, str]) -> None:
    other = UsbLightBox("L0002", port=3)
    bus.boxes.append(other)
    with leds(**given):
        pass
    assert (box.levels, other.levels) == ([], [DARK, DARK])


def test_two_are_listed_not_guessed(bus: UsbBus) -> None:
    bus.boxes.append(UsbLightBox("L0002", port=3))
    with pytest.raises(DeviceError, match=r"L0001 \(port path 1-2\), L0002 \(port path 1-3\); nam"):
        leds().open()


def test_another_serial_number_is_no_box(bus: UsbBus) -> None:
    with pytest.raises(DeviceError, match="16c0:05dc, serial number L9 and"):
        leds(serial="L9").open()


def test_a_box_in_use_is_busy(bus: UsbBus) -> None:
    with leds(), pytest.raises(DeviceBusy, match="the light box at USB 1-2 is in use"):
        leds().open()


def test_a_box_without_permission_names_the_udev_rules(
    bus: UsbBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    bus.protected = True
    with pytest.raises(DeviceError, match=r"must not be opened; install the udev rules with 'sudo"):
        leds().open()


def test_another_version_is_refused(bus: UsbBus, box: UsbLightBox) -> None:
    box.description = "2 tactile-lights 1.0 L0001 6 1 400"
    with pytest.raises(DeviceError, match="USB 1-2 speaks version 2 of the light protocol"):
        leds().open()


def test_without_libusb_the_package_to_install_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_backend(**_: Any) -> Any:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", no_backend)
    with pytest.raises(DeviceError, match="pip install libusb-package"):
        leds().open()


def test_connected_boxes_are_listed_and_other_devices_with_their_id_are_not(bus: UsbBus) -> None:
    (found,) = UsbLeds.connected()
    assert (found.serial, found.port_path, found.usb_id) == ("L0001", "1-2", "16c0:05dc")


def test_a_box_without_permission_is_listed_and_what_to_do_is_said(
    bus: UsbBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    bus.protected = True
    listed = UsbLeds.connected()
    assert {next(listed).port_path, next(listed).port_path} == {"1-1", "1-2"}
    with pytest.raises(DeviceError, match="install the udev rules"):
        next(listed)
