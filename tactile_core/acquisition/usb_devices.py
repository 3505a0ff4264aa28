"""Lists the connected USB cameras."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tactile_core.errors import DeviceError

_VIDEO = 0x0E
_USB3_VISION = (0xEF, 0x05)
"""USB interface class of video devices, and class with subclass of USB3 Vision cameras."""


@dataclass(frozen=True)
class UsbDevice:
    """Descriptor of a USB device.

    Attributes
    ----------
    vendor_id, product_id : int
    product, serial : str or None
        None if the device has none, or the user lacks permission to read it.
    port_path : str
        Bus and ports, such as ``"1-2.4"``; stable as long as the device stays plugged in there.
    """

    vendor_id: int
    product_id: int
    product: str | None
    serial: str | None
    port_path: str

    @property
    def usb_id(self) -> str:
        """Vendor and product id in the format of ``lsusb``."""
        return f"{self.vendor_id:04x}:{self.product_id:04x}"


def usb_cameras(backend: Any = None) -> list[UsbDevice]:
    """Return the connected devices with a video interface, sorted by port.

    Parameters
    ----------
    backend : usb.backend.IBackend, optional
        Default: the installed libusb.

    Raises
    ------
    DeviceError
        libusb is missing or fails.
    """
    import usb.core

    try:
        found = list(usb.core.find(find_all=True, backend=backend, custom_match=_is_camera))
    except usb.core.NoBackendError as error:
        raise DeviceError(
            "USB devices cannot be listed without libusb; install libusb 1.0 (on Debian and "
            "Ubuntu 'apt install libusb-1.0-0', on macOS 'brew install libusb')"
        ) from error
    except usb.core.USBError as error:
        raise DeviceError(f"USB devices cannot be listed: {error.strerror or error}") from error
    return sorted(map(_described, found), key=lambda device: device.port_path)


def _is_camera(device: Any) -> bool:
    kinds = [
        (interface.bInterfaceClass, interface.bInterfaceSubClass)
        for configuration in device
        for interface in configuration
    ]
    return any(kind[0] == _VIDEO or kind == _USB3_VISION for kind in kinds)


def _described(device: Any) -> UsbDevice:
    import usb.util

    ports = ".".join(map(str, device.port_numbers or ()))
    try:
        return UsbDevice(
            device.idVendor,
            device.idProduct,
            _asked(lambda: device.product),
            _asked(lambda: device.serial_number),
            f"{device.bus}-{ports}" if ports else str(device.bus),
        )
    finally:
        usb.util.dispose_resources(device)


def _asked(question: Callable[[], str | None]) -> str | None:
    """Return a device's answer; None if it gives none or must not be opened."""
    import usb.core

    try:
        return question()
    except (usb.core.USBError, ValueError, NotImplementedError):
        return None
