"""The fingertip's profile with a webcam, from the kernel's driver to readings."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from hardware.plugged import FIRST
from hardware.usbip_bus import Bus

from tactile_core import MarkerField, SlipState, open_sensor

READINGS = 2
"""An emulated processor takes seconds for each."""

PROFILE = f"""\
schema: 1
extends: hex_fingertip
name: plugged_fingertip
camera: {{use: core.uvc, product: C310, serial: {FIRST}, width_px: 640, height_px: 480, fps: 30}}
"""


def test_a_plugged_fingertip_gives_readings(bus: Bus, tmp_path: Path) -> None:
    profile = tmp_path / "plugged_fingertip.yaml"
    profile.write_text(PROFILE)
    with open_sensor(profile, reference="first", timeout_s=20) as sensor:
        began_s = time.monotonic()
        readings = [sensor.read() for _ in range(READINGS)]
        took_s = (time.monotonic() - began_s) / READINGS
    print(f"{took_s:.2f} s a reading", file=sys.stderr)
    for reading in readings:
        assert MarkerField in reading
        assert SlipState in reading
