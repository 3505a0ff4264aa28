"""The USB bus by libusb, and why a device cannot be opened."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

from tactile_core.errors import DeviceError, LibraryMissing
from tactile_core.interfaces.device import ConnectedDevice

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


def name_holders(path: str) -> str:
    """Return " by …" with the programs that have a device file open; "" if none is known."""
    found = holders(path)
    return f" by {' and '.join(found)}" if found else ""


def _name_of(process: Path) -> str:
    try:
        return (process / "comm").read_text(encoding="utf-8").strip()
    except OSError:
        return "a program"


# USB interface class of webcams, with every subclass.
VIDEO = frozenset((0x0E, subclass) for subclass in range(256))

USB3_VISION = frozenset({(0xEF, 0x05)})  # USB interface class and subclass of USB3 Vision cameras


def usb_devices(backend: Any = None, **wanted: Any) -> list[Any]:
    """Return the connected devices, as pyusb describes them.

    Parameters
    ----------
    backend : usb.backend.IBackend, optional
        Default: the installed libusb, or that of the package ``libusb-package``.
    **wanted
        What :func:`usb.core.find` selects by.

    Raises
    ------
    DeviceError
        libusb is missing or fails.
    """
    import usb.core

    try:
        return list(usb.core.find(find_all=True, backend=backend or _find_bundled(), **wanted))
    except usb.core.NoBackendError as error:
        raise LibraryMissing(
            "USB devices cannot be found without libusb; run: pip install libusb-package, or "
            "install libusb 1.0 (on Debian and Ubuntu 'apt install libusb-1.0-0', on macOS 'brew "
            "install libusb')"
        ) from error
    except usb.core.USBError as error:
        raise DeviceError(f"USB devices cannot be listed: {error.strerror or error}") from error


def usb_cameras(
    kinds: Container[tuple[int, int]], backend: Any = None
) -> Iterator[ConnectedDevice]:
    """Yield the connected devices with an interface of these kinds; see :data:`VIDEO`.

    Raises
    ------
    DeviceError
        libusb is missing or fails.
    """

    def is_one(device: Any) -> bool:
        return any(
            (interface.bInterfaceClass, interface.bInterfaceSubClass) in kinds
            for configuration in device
            for interface in configuration
        )

    return map(describe_device, usb_devices(backend, custom_match=is_one))


def describe_device(device: Any) -> ConnectedDevice:
    """Describe a device; without its strings if it must not be opened."""
    import usb.util

    try:
        return ConnectedDevice(
            "",
            _ask_device(lambda: device.product) or "",
            f"{device.idVendor:04x}:{device.idProduct:04x}",
            _ask_device(lambda: device.serial_number),
            port_path(device),
            tuple(holders(node_of(device))),
        )
    finally:
        usb.util.dispose_resources(device)


def port_path(device: Any) -> str:
    """Bus and ports that a device is plugged into, such as ``1-2.4``."""
    ports = ".".join(map(str, device.port_numbers or ()))
    return f"{device.bus}-{ports}" if ports else str(device.bus)


def node_of(device: Any) -> str:
    """Device file of a USB device on Linux."""
    return f"/dev/bus/usb/{device.bus or 0:03}/{device.address or 0:03}"


def _ask_device(question: Callable[[], str | None]) -> str | None:
    """Return a device's answer; None if it gives none or must not be opened."""
    import usb.core

    try:
        return question()
    except (usb.core.USBError, ValueError, NotImplementedError):
        return None


def _find_bundled() -> Any:
    """Return the libusb of the package libusb-package; None if there is none."""
    try:
        import libusb_package
    except ImportError:
        return None
    return libusb_package.get_libusb1_backend()
