"""Why a device cannot be opened, and what to do."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

RULES = "60-tactile.rules"  # The udev rules that the package brings

# What to do while a device is absent.
INSTEAD = "measure a recording with --input, or the virtual sensor with --sim"

# What to do where several devices are alike, or the profile's own is not used.
CLAIM = "remember which one belongs to a sensor with 'tactile devices --claim SERIAL=DEVICE'"


def permission_advice() -> str:
    """Return how the user gets permission to open a USB device or a serial port."""
    if not sys.platform.startswith("linux"):
        return "start the program with the permission to use it"
    rules = files("tactile_core").joinpath("udev", RULES)
    return (
        f"install the udev rules with 'sudo cp {rules} /etc/udev/rules.d/ && sudo udevadm control "
        f"--reload && sudo udevadm trigger', and plug the device in again"
    )


def holders(path: str, proc: Path = Path("/proc")) -> list[str]:
    """Return the other programs that have a device file open, as far as one may see them."""
    target, found = os.path.realpath(path), []
    for process in proc.glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        with suppress(OSError):  # another user's process, or one that has ended
            if any(os.path.realpath(link) == target for link in (process / "fd").iterdir()):
                found.append(f"{_name_of(process)} (process {process.name})")
    return sorted(found)


def held(path: str) -> str:
    """Return " by …" with the programs that have a device file open; "" if none is known."""
    found = holders(path)
    return f" by {' and '.join(found)}" if found else ""


def _name_of(process: Path) -> str:
    try:
        return (process / "comm").read_text(encoding="utf-8").strip()
    except OSError:
        return "a program"
