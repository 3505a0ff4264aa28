"""USB cameras that are plugged in, any of which may be a sensor's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tactile_core.errors import DeviceError

_VIDEO = 0x0E
_USB3_VISION = (0xEF, 0x05)
"""Class, and class with subclass, of the interfaces by which cameras are known."""


@dataclass(frozen=True)
class UsbDevice:
    """A USB device as it describes itself.

    Attributes
    ----------
    vendor_id, product_id : int
    product, serial : str or None
        None where it has none, or the user may not ask it.
    port_path : str
        Bus and ports, as ``"1-2.4"``: the same for as long as it stays plugged in there.
    """

    vendor_id: int
    product_id: int
    product: str | None
    serial: str | None
    port_path: str

    @property
    def usb_id(self) -> str:
        """Vendor and product as ``lsusb`` writes them."""
        return f"{self.vendor_id:04x}:{self.product_id:04x}"


def usb_cameras(backend: Any = None) -> list[UsbDevice]:
    """Return the plugged-in devices with an interface for video, by the ports they hang on.

    Parameters
    ----------
    backend : usb.backend.IBackend, optional
        By default the libusb that is installed.

    Raises
    ------
    DeviceError
        There is no libusb, or it fails.
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
    """What a device answers; None where it does not, or may not be opened."""
    import usb.core

    try:
        return question()
    except (usb.core.USBError, ValueError, NotImplementedError):
        return None
