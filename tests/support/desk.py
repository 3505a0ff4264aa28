"""A desk on which a test puts devices, without any that are really connected."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tactile_core.bundles.claims import DeviceKind
from tactile_core.errors import DeviceError
from tactile_core.interfaces.device import ConnectedDevice, Device
from tactile_core.plugins.registry import resolve

KINDS: dict[str, DeviceKind] = {
    "core.uvc": "camera",
    "genicam.camera": "camera",
    "core.serial_leds": "light_driver",
    "core.usb_leds": "light_driver",
}


class Desk:
    """Replaces what each component finds, and the user's data directory."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        monkeypatch.setenv("XDG_DATA_HOME", str(folder))
        self.claims = folder / "tactile-core" / "claims.json"
        self.devices: dict[str, list[ConnectedDevice]] = {use: [] for use in KINDS}
        self.missing: dict[str, str] = {}
        for use, kind in KINDS.items():

            def connected(cls: type[Device], use: str = use) -> Iterator[ConnectedDevice]:
                yield from self.devices[use]
                if use in self.missing:
                    raise DeviceError(self.missing[use])

            monkeypatch.setattr(resolve(kind, use), "connected", classmethod(connected))

    def plug(self, use: str, device: ConnectedDevice) -> ConnectedDevice:
        """Connect a device that this component finds."""
        self.devices[use].append(device)
        return device

    def webcam(self, serial: str | None, port: str, **more: object) -> ConnectedDevice:
        """Connect a C310."""
        number = len(self.devices["core.uvc"])
        device = ConnectedDevice(
            f"/dev/video{2 * number}", "HD Webcam C310", "046d:081b", serial, port, **more
        )  # type: ignore[arg-type]
        return self.plug("core.uvc", device)

    def arduino(self, serial: str | None, port: str) -> ConnectedDevice:
        """Connect a light box at a serial port."""
        number = len(self.devices["core.serial_leds"])
        device = ConnectedDevice(f"/dev/ttyACM{number}", "Arduino Uno", "2341:0043", serial, port)
        return self.plug("core.serial_leds", device)
