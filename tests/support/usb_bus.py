"""A backend of pyusb with emulated light boxes plugged in."""

from __future__ import annotations

import errno
import struct
from types import SimpleNamespace
from typing import Any

from support.usb_light_box import UsbLightBox
from usb.backend import IBackend
from usb.core import USBError, USBTimeoutError

_NAMES = {
    "device": "bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 idVendor "
    "idProduct bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations",
    "configuration": "wTotalLength bNumInterfaces bConfigurationValue iConfiguration "
    "bmAttributes bMaxPower",
    "interface": "bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass "
    "bInterfaceSubClass bInterfaceProtocol iInterface",
}
"""Fields of each descriptor, after length and type."""


def described(kind: str, layout: str, data: bytes, **more: object) -> Any:
    names = ("bLength", "bDescriptorType", *_NAMES[kind].split(" "))
    return SimpleNamespace(**dict(zip(names, struct.unpack(layout, data), strict=True)), **more)


class UsbBus(IBackend):
    """A bus with these boxes.

    Attributes
    ----------
    opened : int
        Number of open handles.
    protected : bool
        Whether this user must not open the devices.
    """

    def __init__(self, *boxes: UsbLightBox) -> None:
        super().__init__()
        self.boxes = list(boxes)
        self.opened = 0
        self.protected = False
        self._claimed: dict[UsbLightBox, object] = {}

    def enumerate_devices(self) -> Any:
        return iter([box for box in self.boxes if not box.gone])

    def get_parent(self, dev: UsbLightBox) -> None:
        return None

    def get_device_descriptor(self, dev: UsbLightBox) -> Any:
        return described(
            "device", "<BBHBBBBHHHBBBB", dev.device_descriptor, bus=1, address=10 + dev.port,
            port_number=dev.port, port_numbers=(dev.port,), speed=2,
        )  # fmt: skip

    def get_configuration_descriptor(self, dev: UsbLightBox, config: int) -> Any:
        if config:
            raise IndexError
        data = dev.configuration[:9]
        return described("configuration", "<BBHBBBBB", data, extra_descriptors=[])

    def get_interface_descriptor(self, dev: UsbLightBox, intf: int, alt: int, config: int) -> Any:
        if intf or alt:
            raise IndexError
        return described("interface", "<9B", dev.configuration[9:18], extra_descriptors=[])

    def open_device(self, dev: UsbLightBox) -> Any:
        if self.protected:
            raise USBError("Access denied (insufficient permissions)", -3, errno.EACCES)
        self.opened += 1
        return SimpleNamespace(box=dev)

    def close_device(self, dev_handle: Any) -> None:
        self.opened -= 1

    def get_configuration(self, dev_handle: Any) -> int:
        return 1

    def claim_interface(self, dev_handle: Any, intf: int) -> None:
        if self._claimed.setdefault(dev_handle.box, dev_handle) is not dev_handle:
            raise USBError("Resource busy", -6, errno.EBUSY)

    def release_interface(self, dev_handle: Any, intf: int) -> None:
        self._claimed.pop(dev_handle.box)

    def ctrl_transfer(  # type: ignore[no-untyped-def]
        self, dev_handle, bmRequestType, bRequest, wValue, wIndex, data, timeout
    ) -> int:
        box = dev_handle.box
        if box.gone:
            raise USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)
        if box.silent:
            raise USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
        answer = box.control(bmRequestType, bRequest, wValue, bytes(data))
        if answer is None:
            raise USBError("Pipe error", -9, errno.EPIPE)
        if not bmRequestType & 0x80:
            return len(data)
        answer = answer[: len(data)]
        data[: len(answer)] = type(data)("B", answer)
        return len(answer)
