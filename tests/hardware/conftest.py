"""The emulated devices as a guest sees them; the tests in ``*_in_guest.py`` use them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hardware.guest import HOST
from hardware.plugged import BOX, PLUGS, WEBCAMS
from hardware.usbip_bus import Bus, wait_for, webcams_are_there


@pytest.fixture(scope="session")
def empty_bus() -> Iterator[Bus]:
    usb_port, control_port = map(int, os.environ["TACTILE_RIG"].split())
    bus = Bus(HOST, usb_port, control_port)
    yield bus
    bus.close()


@pytest.fixture
def bus(empty_bus: Bus) -> Bus:
    """The bus with all devices, which do what they should."""
    for serial in WEBCAMS:
        if not empty_bus.is_plugged(PLUGS[serial]):
            empty_bus.plug(PLUGS[serial])
        empty_bus.ask(serial, "stall", 0)
        empty_bus.ask(serial, "crowd", 0)
    if not empty_bus.is_plugged(PLUGS[BOX]):
        empty_bus.plug(PLUGS[BOX])
    wait_for(webcams_are_there)
    wait_for(Path("/dev/ttyACM0").exists)
    return empty_bus
