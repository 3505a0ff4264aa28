"""Description of the machine that a benchmark runs on."""

from __future__ import annotations

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = ("numpy", "scipy", "opencv-contrib-python-headless", "scikit-image")


def machine() -> dict[str, Any]:
    """Name of the processor, available cores, and versions (None: not installed)."""
    from tactile_core import __version__

    return {
        "cpu": _cpu_name(),
        "cores": available_cores(),
        "system": platform.platform(terse=True),
        "versions": {
            "tactile-core": __version__,
            "python": platform.python_version(),
            **{name: _version(name) for name in _PACKAGES},
        },
    }


def available_cores() -> int:
    """Number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith(("model name", "Model")):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
