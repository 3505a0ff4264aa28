"""A program in whose USB umockdev has plugged a light box."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from ctypes.util import find_library
from functools import cache
from pathlib import Path
from typing import Any

EMULATOR = Path(__file__).with_name("usb_emulator.py")
PYTHON = "/usr/bin/python3"
"""The system's, for which Debian packages gi."""


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


def printed_by(
    program: str, fault: str = "none", after: int = -1
) -> tuple[list[str], dict[str, Any]]:
    """Run a Python program, and return what it printed and what the box was set to.

    Parameters
    ----------
    program : str
        Its text.
    fault : {"none", "unplug", "silence"}
        What happens after the lights were set ``after`` times.
    """
    command = [PYTHON, EMULATOR, fault, str(after), "--", sys.executable, "-c", program]
    paths = os.environ | {"PYTHONPATH": str(EMULATOR.parents[1])}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=paths)
    assert not done.returncode, done.stderr
    *printed, box = done.stdout.splitlines()
    return printed, json.loads(box)
