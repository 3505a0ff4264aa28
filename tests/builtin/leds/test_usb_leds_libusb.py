"""Boxes of LEDs on USB: unmodified pyusb and libusb, and a box emulated by umockdev."""

from __future__ import annotations

import json
import subprocess
import sys
from ctypes.util import find_library
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from support.light_box import LIGHTS

EMULATOR = Path(__file__).parents[2] / "support" / "usb_emulator.py"
PYTHON = "/usr/bin/python3"
"""The system's, for which Debian packages gi."""

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


@cache
def missing() -> str:
    """Return what is not installed, or ""."""
    if not find_library("usb-1.0"):
        return "libusb-1.0-0"
    probe = "import gi; gi.require_version('UMockdev', '1.0')"
    if (
        not Path(PYTHON).exists()
        or subprocess.run([PYTHON, "-c", probe], capture_output=True, check=False).returncode
    ):
        return "umockdev gir1.2-umockdev-1.0 python3-gi"
    return ""


pytestmark = pytest.mark.skipif(bool(missing()), reason=f"needs: apt install {missing()}")


def used(fault: str = "none", after: int = -1) -> tuple[list[str], dict[str, Any]]:
    """Return what the program with the driver printed, and what the box was set to."""
    command = [PYTHON, EMULATOR, fault, str(after), "--", sys.executable, "-c", CLIENT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert not done.returncode, done.stderr
    *printed, box = done.stdout.splitlines()
    return printed, json.loads(box)


def test_lights_are_set_and_go_out() -> None:
    printed, box = used()
    assert printed == ["L0001 6", "opens again"]
    assert [levels[1] for levels in box["levels"]] == [0, 255, 128, 64, 0, 0, 0]


def test_an_unplugged_box_is_reported_and_is_no_longer_there() -> None:
    printed, _ = used("unplug", 3)
    assert printed[1].startswith("the light box at USB 1-2 was disconnected; plug it in")
    assert printed[2].startswith("no light box with the USB id 16c0:05dc")


def test_a_silent_box_is_reported() -> None:
    printed, _ = used("silence", 3)
    assert printed[1].startswith("the light box at USB 1-2 does not answer within 0.5 s")
    assert "opens again" not in printed
