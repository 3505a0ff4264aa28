"""Cameras and lights against real kernel drivers, in a guest; with ``make test-hardware``."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hardware.guest import Unavailable, run_in_guest

ROOT = Path(__file__).resolve().parents[2]
# of this checkout, whichever the environment has installed
PACKAGES = os.pathsep.join(map(str, (ROOT / "tests", ROOT, *sorted((ROOT / "plugins").iterdir()))))
MODULES = ("vhci_hcd", "uvcvideo", "cdc_acm")
SIZES = ("TACTILE_FRAMES", "TACTILE_OBSERVATIONS", "TACTILE_READINGS", "TACTILE_UNPLUGS")
"""How many images, observations of six lights, readings and unplugs the guest tries, if set."""

pytestmark = [pytest.mark.hardware, pytest.mark.timeout(900)]


def free_port() -> int:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        return int(unused.getsockname()[1])


@pytest.fixture
def rig() -> Iterator[str]:
    """The ports of the emulated devices."""
    pytest.importorskip("usbip", reason="'pip install usbip' emulates USB devices")
    ports = [str(free_port()), str(free_port())]
    server = subprocess.Popen(
        [sys.executable, str(ROOT / "tests" / "hardware" / "usb_rig.py"), *ports],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": PACKAGES},
    )
    assert server.stdin is not None
    assert server.stdout is not None
    with server:
        assert server.stdout.readline() == b"serving\n"
        yield " ".join(ports)
        server.stdin.close()


def test_cameras_and_lights_in_a_guest(rig: str, tmp_path: Path) -> None:
    asked = " ".join(f"{name}={os.environ[name]}" for name in SIZES if name in os.environ)
    files = os.environ.get("TACTILE_GUEST_TESTS", "tests/hardware/*_in_guest.py")
    command = (
        f"{asked} TACTILE_RIG='{rig}' PYTHONPATH='{PACKAGES}' "
        f"{sys.executable} -m pytest -p no:cacheprovider -p no:benchmark "
        f"-rA --tb=short --color=no -o addopts=--import-mode=importlib "
        f"{files}"
    )
    try:
        status, printed = run_in_guest(command, ROOT, tmp_path, modules=MODULES, timeout_s=800)
    except Unavailable as reason:
        pytest.skip(str(reason))
    print(printed)
    assert status == 0, printed
