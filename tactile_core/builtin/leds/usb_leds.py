"""``core.usb_leds``: a box of LEDs on USB, with vendor requests."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import BaseModel, Field

from tactile_core.builtin.leds.led_box import BoxOptions, LedBox, Link
from tactile_core.builtin.leds.usb_link import GONE, UsbLink, port_path, refused
from tactile_core.errors import DeviceError

PRODUCT = "Tactile lights"
"""How the product's name begins; ids may be shared with other projects."""


class UsbOptions(BoxOptions):
    """Options of ``core.usb_leds``; those that are given select the device."""

    usb_id: str = Field(
        default="16c0:05dc",
        pattern=r"^[0-9a-f]{4}:[0-9a-f]{4}$",
        description="Vendor and product id, as lsusb lists them.",
    )
    port_path: str | None = Field(
        default=None, description="USB bus and ports that it is plugged into, such as 1-2.4."
    )


class UsbLeds(LedBox):
    """Sets the lights of a box with the light protocol over USB.

    A box that does not answer is an error after ``timeout_s``.
    """

    Options: ClassVar[type[BaseModel]] = UsbOptions

    backend: ClassVar[Any] = None
    """Backend of pyusb; None for the installed libusb."""

    def __init__(self, options: UsbOptions) -> None:
        super().__init__(options)
        self._where = options

    def _connect(self) -> Link:
        return UsbLink(find(self._where, self.backend or _bundled()), self._where.timeout_s)


def find(options: UsbOptions, backend: Any = None) -> Any:
    """Return the one connected box that fits the options.

    Returns
    -------
    usb.core.Device

    Raises
    ------
    DeviceError
        libusb is missing, none fits, several do, or the only one must not be opened.
    """
    import usb.core
    import usb.util

    vendor, product = (int(part, 16) for part in options.usb_id.split(":"))
    try:
        same = usb.core.find(find_all=True, backend=backend, idVendor=vendor, idProduct=product)
        there = [one for one in same if options.port_path in (None, port_path(one))]
    except usb.core.NoBackendError as error:
        raise DeviceError(
            "core.usb_leds needs libusb; run: pip install libusb-package, or install libusb 1.0 "
            "(on Debian and Ubuntu 'apt install libusb-1.0-0')"
        ) from error
    except usb.core.USBError as error:
        raise DeviceError(f"USB devices cannot be listed: {error.strerror or error}") from error
    boxes, serials, closed = [], [], None
    for device in there:
        try:
            name, serial = device.product, device.serial_number
        except (usb.core.USBError, ValueError, NotImplementedError) as error:
            reason = _reason(device, error)
            if getattr(reason, "errno", None) not in GONE:  # else it was unplugged just now
                closed = closed or refused(device, reason)
        else:
            if str(name).startswith(PRODUCT) and options.serial in (None, serial):
                boxes.append(device)
                serials.append(f"{serial} (port path {port_path(device)})")
        usb.util.dispose_resources(device)
    if len(boxes) == 1:
        return boxes[0]
    if boxes:
        raise DeviceError(
            f"several light boxes are connected: {', '.join(serials)}; name one with 'serial' or "
            f"'port_path' of the light driver"
        )
    if closed is not None:
        raise closed
    wanted = "".join(
        f", {name} {value}"
        for name, value in (("serial number", options.serial), ("port path", options.port_path))
        if value is not None
    )
    raise DeviceError(
        f"no light box with the USB id {options.usb_id}{wanted} and a product name that begins "
        f"with {PRODUCT!r} is connected; plug it in, or correct the light driver's options"
    )


def _reason(device: Any, error: Exception) -> Exception:
    """Return why the names of a device are not readable; pyusb says so only when it is opened."""
    import usb.core

    try:
        device.get_active_configuration()
    except (usb.core.USBError, NotImplementedError) as opening:
        return opening
    return error


def _bundled() -> Any:
    """Return the libusb of the package libusb-package; None if there is none."""
    try:
        import libusb_package
    except ImportError:
        return None
    return libusb_package.get_libusb1_backend()
