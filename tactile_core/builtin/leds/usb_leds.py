"""``core.usb_leds``: a box of LEDs on USB, with vendor requests."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import BaseModel, Field

from tactile_core.builtin.device_access import CLAIM, INSTEAD
from tactile_core.builtin.leds.led_box import BoxOptions, LedBox, Link
from tactile_core.builtin.leds.usb_link import GONE, UsbLink, refused
from tactile_core.builtin.usb_bus import described, port_path, usb_devices
from tactile_core.errors import DeviceAbsent
from tactile_core.interfaces.connected_device import ConnectedDevice

PRODUCT = "Tactile lights"  # How the product's name begins; ids may be shared with other projects

USB_ID = "16c0:05dc"  # The id that projects share


class UsbOptions(BoxOptions):
    """Options of ``core.usb_leds``; those that are given select the device."""

    usb_id: str = Field(
        default=USB_ID,
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
    selectors: ClassVar[Mapping[str, str]] = {
        "usb_id": "usb_id",
        "serial": "serial",
        "port_path": "port_path",
    }

    backend: ClassVar[Any] = None
    """Backend of pyusb; None for the installed libusb."""

    def __init__(self, options: UsbOptions) -> None:
        super().__init__(options)
        self._where = options

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield the connected boxes with the shared USB id."""
        closed = None
        for device in _with_id(USB_ID, cls.backend):
            found = described(device)
            if not found.product:
                reason = _reason(device)
                if getattr(reason, "errno", None) != errno.EACCES:
                    continue  # it has no name, or was unplugged just now
                closed = closed or refused(device, reason)
            elif not found.product.startswith(PRODUCT):
                continue
            yield found
        if closed is not None:
            raise closed

    def _connect(self) -> Link:
        return UsbLink(find(self._where, self.backend), self._where.timeout_s)


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

    same = _with_id(options.usb_id, backend)
    there = [one for one in same if options.port_path in (None, port_path(one))]
    boxes, serials, closed = [], [], None
    for device in there:
        try:
            name, serial = device.product, device.serial_number
        except (usb.core.USBError, ValueError, NotImplementedError) as error:
            reason = _reason(device) or error
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
        raise DeviceAbsent(
            f"several light boxes are connected: {', '.join(serials)}; name one with 'serial' or "
            f"'port_path' of the light driver, or {CLAIM}"
        )
    if closed is not None:
        raise closed
    wanted = "".join(
        f", {name} {value}"
        for name, value in (("serial number", options.serial), ("port path", options.port_path))
        if value is not None
    )
    raise DeviceAbsent(
        f"no light box with the USB id {options.usb_id}{wanted} and a product name that begins "
        f"with {PRODUCT!r} is connected; plug it in, correct the light driver's options, {INSTEAD}"
    )


def _with_id(usb_id: str, backend: Any) -> list[Any]:
    vendor, product = (int(part, 16) for part in usb_id.split(":"))
    return usb_devices(backend, idVendor=vendor, idProduct=product)


def _reason(device: Any) -> Exception | None:
    """Return why the names of a device are not readable; pyusb says so only when it is opened."""
    import usb.core
    import usb.util

    try:
        device.get_active_configuration()
    except (usb.core.USBError, NotImplementedError) as opening:
        return opening
    finally:
        usb.util.dispose_resources(device)
    return None
