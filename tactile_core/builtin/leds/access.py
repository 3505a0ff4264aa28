"""Why a device node cannot be opened, and what to do."""

from __future__ import annotations

import os
import sys
from importlib.resources import files
from pathlib import Path

_PROCESSES = Path("/proc")

RULES = "60-tactile.rules"
"""The udev rules that the package brings."""


def permission_advice() -> str:
    """Return how the user gets permission to open a USB device or a serial port."""
    if not sys.platform.startswith("linux"):
        return "start the program with the permission to use it"
    rules = files("tactile_core").joinpath("udev", RULES)
    return (
        f"install the udev rules with 'sudo cp {rules} /etc/udev/rules.d/ && sudo udevadm control "
        f"--reload && sudo udevadm trigger', and plug the light box in again"
    )


def holder_of(node: str) -> str:
    """Return which other processes have a device node open, as " by …"; "" if it is unknown."""
    target, own = os.path.realpath(node), str(os.getpid())
    found = []
    for process in _PROCESSES.iterdir() if _PROCESSES.is_dir() else ():
        if process.name.isdigit() and process.name != own and _has_open(process, target):
            found.append(f"{_name_of(process)} (process {process.name})")
    return f" by {' and '.join(found)}" if found else ""


def _has_open(process: Path, target: str) -> bool:
    try:
        return any(os.path.realpath(entry) == target for entry in (process / "fd").iterdir())
    except OSError:
        return False  # another user's, or it has ended


def _name_of(process: Path) -> str:
    try:
        return (process / "comm").read_text(encoding="utf-8").strip()
    except OSError:
        return "a program"
