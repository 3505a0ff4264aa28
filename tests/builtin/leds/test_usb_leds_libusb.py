"""Boxes of LEDs on USB: unmodified pyusb and libusb, and a box emulated by umockdev."""

from __future__ import annotations

import pytest
from support.light_box import LIGHTS
from support.usb_emulation import missing, printed_by

CLIENT = f"""
from tactile_core.builtin.leds.usb_leds import UsbLeds
from tactile_core.errors import DeviceError
driver = UsbLeds(UsbLeds.Options(lights={LIGHTS!r}, timeout_s=0.5))
try:
    with driver:
        print(driver.info.serial, driver.info.lights)
        for level in (1.0, 0.5, 0.25):
            driver.set({{"led2": level}})
except DeviceError as error:
    print(error)
try:
    driver.open().close()
    print("opens again")
except DeviceError as error:
    print(error)
"""
DARK = [0] * 6


pytestmark = pytest.mark.skipif(bool(missing()), reason=f"needs: apt install {missing()}")


def test_lights_are_set_and_go_out() -> None:
    printed, box = printed_by(CLIENT)
    assert printed == ["L0001 6", "opens again"]
    assert [levels[1] for levels in box["levels"]] == [0, 255, 128, 64, 0, 0, 0]


def test_an_unplugged_box_is_reported_and_is_no_longer_there() -> None:
    printed, _ = printed_by(CLIENT, "unplug", 3)
    assert printed[1].startswith("the light box at USB 1-2 was disconnected; plug it in")
    assert printed[2].startswith("no light box with the USB id 16c0:05dc")


def test_a_silent_box_is_reported() -> None:
    printed, _ = printed_by(CLIENT, "silence", 3)
    assert printed[1].startswith("the light box at USB 1-2 does not answer within 0.5 s")
    assert "opens again" not in printed
