"""``core.usb_leds``: lights on a USB device, and the link to it."""

from __future__ import annotations

import errno
import time
from collections.abc import Iterator, Mapping
from itertools import cycle
from typing import Any, ClassVar

from pydantic import BaseModel, Field

from tactile_core.builtin.leds.led_box import UNASKED, BoxInfo, BoxOptions, LedBox, LineError, Link
from tactile_core.errors import DeviceAbsent, DeviceBusy, DeviceError, DeviceForbidden, LightsLost
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.interfaces.usb_bus import (
    CLAIM,
    INSTEAD,
    describe_device,
    name_holders,
    node_of,
    permission_advice,
    port_path,
    usb_devices,
)

_TO_BOX, _FROM_BOX = 0x40, 0xC0  # Request types: vendor request to the device, out and in

_DESCRIBE, _SET, _STATUS, _ALIVE = 1, 2, 3, 4  # Requests of the protocol

# Error numbers of a device that was unplugged.
GONE = (errno.ENODEV, errno.ENXIO, errno.EIO, errno.ESHUTDOWN, errno.ENOENT)

_POLL_S = 0.001  # [s] Interval at which the status is asked for: one frame of full-speed USB


class UsbLink:
    """A box on USB, claimed for this process.

    Parameters
    ----------
    device : usb.core.Device
        Released with the link, or if the box cannot be claimed or does not describe itself.
    timeout_s : float
        Longest wait for an acknowledgement.

    Raises
    ------
    DeviceBusy, DeviceError
        The box is in use, must not be opened, or has another version of the protocol.
    """

    def __init__(self, device: Any, timeout_s: float) -> None:
        self.place = f"USB {port_path(device)}"
        self._device = device
        self._timeout_s = timeout_s
        self._numbers = cycle(range(UNASKED + 1, 256))
        try:
            self._claim()
            text = self._ask(_DESCRIBE, 128, timeout_s)  # [bytes] twice the line of the protocol
            self.info = BoxInfo.from_words(text.decode("ascii", "replace").split())
        except LineError as error:
            self.close()
            raise DeviceError(f"the light box at {self.place} {error}") from error
        except BaseException:
            self.close()
            raise

    def set_levels(self, levels: bytes) -> None:
        """Set the level of each output, and return once the lights have settled."""
        until = time.monotonic() + self._timeout_s
        number = next(self._numbers)
        self._say(_SET, number, levels)
        time.sleep(min(self.info.settle_s, self._timeout_s))
        while self._ask(_STATUS, 1, max(until - time.monotonic(), _POLL_S)) != bytes([number]):
            if time.monotonic() > until:
                raise self._silent()
            time.sleep(_POLL_S)

    def keep_alive(self) -> None:
        """Keep the lights on."""
        self._say(_ALIVE, UNASKED, b"")

    def close(self) -> None:
        """Release the device."""
        import usb.util

        usb.util.dispose_resources(self._device)

    def _claim(self) -> None:
        import usb.core
        import usb.util

        try:
            # Claimed, so that no other program uses the box
            usb.util.claim_interface(self._device, 0)
        except (usb.core.USBError, NotImplementedError) as error:
            raise explain_refusal(self._device, error) from error

    def _say(self, request: int, value: int, data: bytes) -> None:
        self._transfer(_TO_BOX, request, value, data, self._timeout_s)

    def _ask(self, request: int, length: int, timeout_s: float) -> bytes:
        return bytes(self._transfer(_FROM_BOX, request, UNASKED, length, timeout_s))

    def _transfer(self, kind: int, request: int, value: int, data: Any, timeout_s: float) -> Any:
        import usb.core

        milliseconds = max(1, round(1e3 * timeout_s))  # 0 would wait forever
        try:
            return self._device.ctrl_transfer(kind, request, value, 0, data, milliseconds)
        except usb.core.USBTimeoutError as error:
            raise self._silent() from error
        except usb.core.USBError as error:
            raise self._explain_failure(error) from error

    def _silent(self) -> DeviceError:
        return DeviceError(
            f"the light box at {self.place} does not answer within {self._timeout_s:g} s; check "
            f"its cable and power"
        )

    def _explain_failure(self, error: Any) -> DeviceError:
        if error.errno == errno.EPIPE:
            return DeviceError(
                f"the light box at {self.place} refuses a request; load the firmware that belongs "
                f"to this version of tactile-core"
            )
        if error.errno in GONE:
            return LightsLost(
                f"the light box at {self.place} was disconnected; plug it in and open the sensor "
                f"again"
            )
        return explain_refusal(self._device, error)


def explain_refusal(device: Any, error: Exception | None) -> DeviceError:
    """Explain why a device cannot be opened or claimed."""
    number, where = getattr(error, "errno", None), f"the light box at USB {port_path(device)}"
    if number == errno.EACCES:
        return DeviceForbidden(f"{where} must not be opened; {permission_advice()}")
    if number == errno.EBUSY:
        return DeviceBusy(f"{where} is in use{name_holders(node_of(device))}; close that first")
    if isinstance(error, NotImplementedError):
        return DeviceError(f"{where} has no WinUSB driver; install it with Zadig (zadig.akeo.ie)")
    return DeviceError(f"{where} cannot be used: {getattr(error, 'strerror', None) or error}")


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
            found = describe_device(device)
            if not found.product:
                reason = _reason(device)
                if getattr(reason, "errno", None) != errno.EACCES:
                    continue  # it has no name, or was unplugged just now
                closed = closed or explain_refusal(device, reason)
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
                closed = closed or explain_refusal(device, reason)
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
