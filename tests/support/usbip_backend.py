"""A backend of pyusb that speaks USB/IP to emulated light boxes in this process.

Descriptors, strings and requests cross the wire of USB/IP, in the form in which a device sends
them, without a kernel's help.
"""

from __future__ import annotations

import errno
import struct
from array import array
from collections.abc import Callable
from threading import Event
from types import SimpleNamespace
from typing import Any

from support.usb_bus import described
from support.usb_light_box import UsbLightBox
from usb.backend import IBackend
from usb.core import USBError, USBTimeoutError
from usbip import Interface, Loopback, NotFound, Stall, USBDevice, host
from usbip.core import USBError as WireError

_IN, _GET_DESCRIPTOR, _DEVICE, _CONFIGURATION = 0x80, 6, 0x100, 0x200
_DEVICE_BYTES, _CONFIGURATION_BYTES, _INTERFACE_BYTES = 18, 9, 9


class _Answers(Interface):  # type: ignore[misc]
    """The vendor interface of a box."""

    bInterfaceClass = 0xFF  # noqa: N815

    def __init__(self, box: UsbLightBox, loud: Event) -> None:
        super().__init__()
        self._box, self._loud = box, loud

    def on_control(self, setup: Any, data: bytes = b"") -> bytes:
        self._loud.wait()
        kind, request = setup.bmRequestType, setup.bRequest
        answer = self._box.control(kind, request, setup.wValue, bytes(data))
        if answer is None:
            raise Stall
        return answer


class Plugged:
    """A box that is plugged in.

    Attributes
    ----------
    loud : Event
        Whether it answers vendor requests.
    """

    def __init__(self, box: UsbLightBox) -> None:
        self.box, self.loud, self.wire = box, Event(), Loopback()
        self.loud.set()
        self._device = USBDevice(
            *box.ids, manufacturer=box.strings[1], product=box.strings[2], serial=box.strings[3]
        )
        interface = _Answers(box, self.loud)
        self._device.add(interface)
        self._device.on_control(None, interface.on_control)
        self._device.plug(via=self.wire)

    def unplug(self) -> None:
        """Break its connections."""
        self.loud.set()
        self._device.unplug()


class UsbipBackend(IBackend):
    """A bus with boxes plugged in.

    Attributes
    ----------
    plugged : list of Plugged
    """

    def __init__(self, *boxes: UsbLightBox) -> None:
        super().__init__()
        self.plugged = [Plugged(box) for box in boxes]

    def unplug(self, box: UsbLightBox) -> None:
        (there,) = (one for one in self.plugged if one.box is box)
        self.plugged.remove(there)
        there.unplug()

    def close(self) -> None:
        for one in self.plugged:
            one.unplug()

    def enumerate_devices(self) -> Any:
        for one in self.plugged:
            handle = host.open(transport=one.wire, set_config=None)
            device = self._descriptor(handle, _DEVICE, _DEVICE_BYTES)
            length = self._descriptor(handle, _CONFIGURATION, _CONFIGURATION_BYTES)
            (total,) = struct.unpack_from("<H", length, 2)
            configuration = self._descriptor(handle, _CONFIGURATION, total)
            handle.close()
            yield SimpleNamespace(plugged=one, device=device, configuration=configuration)

    def get_parent(self, dev: Any) -> None:
        return None

    def get_device_descriptor(self, dev: Any) -> Any:
        port = dev.plugged.box.port
        return described(
            "device", "<BBHBBBBHHHBBBB", dev.device, bus=1, address=10 + port, port_number=port,
            port_numbers=(port,), speed=2,
        )  # fmt: skip

    def get_configuration_descriptor(self, dev: Any, config: int) -> Any:
        if config:
            raise IndexError
        data = dev.configuration[:_CONFIGURATION_BYTES]
        return described("configuration", "<BBHBBBBB", data, extra_descriptors=[])

    def get_interface_descriptor(self, dev: Any, intf: int, alt: int, config: int) -> Any:
        if intf or alt:
            raise IndexError
        data = dev.configuration[_CONFIGURATION_BYTES:][:_INTERFACE_BYTES]
        return described("interface", "<9B", data, extra_descriptors=[])

    def open_device(self, dev: Any) -> Any:
        try:
            return host.open(transport=dev.plugged.wire, set_config=None)
        except (OSError, NotFound, WireError) as error:
            raise _gone() from error

    def close_device(self, dev_handle: Any) -> None:
        dev_handle.close()

    def get_configuration(self, dev_handle: Any) -> int:
        return 1

    def claim_interface(self, dev_handle: Any, intf: int) -> None:
        """USB/IP has none: a device belongs to the one who attached it."""

    def release_interface(self, dev_handle: Any, intf: int) -> None:
        """As for claiming."""

    def ctrl_transfer(  # type: ignore[no-untyped-def]
        self, dev_handle, bmRequestType, bRequest, wValue, wIndex, data, timeout
    ) -> int:
        out = bytes(data)
        request = (bmRequestType, bRequest, wValue, wIndex)
        if not bmRequestType & _IN:
            self._timed(dev_handle, timeout, lambda: dev_handle.control(*request, out))
            return len(out)
        answer = self._timed(dev_handle, timeout, lambda: dev_handle.control(*request, len(out)))
        data[: len(answer)] = array("B", answer)
        return len(answer)

    def _descriptor(self, handle: Any, which: int, length: int) -> bytes:
        return bytes(handle.control(_IN, _GET_DESCRIPTOR, which, 0, length))

    def _timed(self, handle: Any, timeout_ms: int, transfer: Callable[[], Any]) -> Any:
        try:
            handle.conn.sock.settimeout(timeout_ms / 1000)
            return transfer()
        except Stall as error:
            raise USBError("Pipe error", -9, errno.EPIPE) from error
        except TimeoutError as error:
            raise USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT) from error
        except (OSError, WireError) as error:
            raise _gone() from error


def _gone() -> USBError:
    return USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)
