"""Finds and opens the serial port of a box."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

from pydantic import Field

from tactile_core.builtin.device_access import CLAIM, INSTEAD, held, holders, permission_advice
from tactile_core.builtin.leds.led_box import BoxOptions
from tactile_core.builtin.leds.serial_link import SERIAL
from tactile_core.errors import DeviceAbsent, DeviceBusy, DeviceError, DeviceForbidden
from tactile_core.interfaces.connected_device import ConnectedDevice

_BUSY = (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK)


class SerialOptions(BoxOptions):
    """Options of ``core.serial_leds``; those that are given select the port."""

    port: str | None = Field(
        default=None, description="Name of the port, for example /dev/ttyACM0 or COM3."
    )
    usb_id: str | None = Field(
        default=None,
        pattern=r"^[0-9a-f]{4}:[0-9a-f]{4}$",
        description="Vendor and product id of its USB device, as lsusb lists them.",
    )
    usb_serial: str | None = Field(
        default=None, description="Serial number of its USB device; cheap boards have none."
    )
    port_path: str | None = Field(
        default=None, description="USB bus and ports that it is plugged into, such as 1-2.4."
    )


def find_port(options: SerialOptions) -> str:
    """Return the name of the one port that fits the options.

    Raises
    ------
    DeviceAbsent
        None fits, or several do; the message lists them.
    """
    if options.port is not None:
        return options.port
    from serial.tools import list_ports

    return choose(list_ports.comports(), options)


def usb_ports() -> Iterator[ConnectedDevice]:
    """Yield the serial ports of USB devices."""
    from serial.tools import list_ports

    for port in list_ports.comports():
        if port.vid is not None:
            yield ConnectedDevice(
                port.device,
                port.product or "",
                f"{port.vid:04x}:{port.pid:04x}",
                port.serial_number or None,
                _path_of(port),
                tuple(holders(port.device)),
            )


def choose(ports: Iterable[Any], options: SerialOptions) -> str:
    """Choose among ports, as pyserial describes them; see :func:`find_port`."""
    usb = [port for port in ports if port.vid is not None]
    fitting = [port for port in usb if _fits(port, options)]
    if len(fitting) == 1:
        return str(fitting[0].device)
    wanted = ", ".join(
        f"{key} {value}"
        for key in ("usb_id", "usb_serial", "port_path")
        if (value := getattr(options, key)) is not None
    )
    if fitting:
        raise DeviceAbsent(
            f"several serial ports{f' with {wanted}' if wanted else ''} may be the light box: "
            f"{_list(fitting)}; name one with 'usb_serial' or 'port_path' of the light driver, or "
            f"{CLAIM}"
        )
    others = f"; connected are {_list(usb)}" if usb else "; no USB serial port is connected"
    raise DeviceAbsent(
        f"no serial port{f' with {wanted}' if wanted else ''} for the light box{others}; plug it "
        f"in, correct the light driver's options, {INSTEAD}"
    )


def open_port(name: str, timeout_s: float) -> Any:
    """Open a port for this process alone.

    Returns
    -------
    serial.Serial

    Raises
    ------
    DeviceBusy, DeviceError
    """
    import serial

    try:
        port = serial.Serial(
            name,
            SERIAL.baud,
            timeout=SERIAL.slice_s,
            write_timeout=timeout_s,
            exclusive=True,
        )
    except (OSError, ValueError) as error:  # SerialException is an OSError
        raise _explained(name, error) from error
    with suppress(AttributeError, NotImplementedError, OSError, ValueError):
        port.set_low_latency_mode(True)  # else an FTDI adapter waits 16 ms for more to come
    return port


def _explained(name: str, error: OSError | ValueError) -> DeviceError:
    number = getattr(error, "errno", None)
    if number in _BUSY or isinstance(error.__context__, BlockingIOError):
        return DeviceBusy(f"the serial port {name} is in use{held(name)}; close that first")
    if number == errno.EACCES or isinstance(error.__context__, PermissionError):
        return DeviceForbidden(f"the serial port {name} must not be opened; {permission_advice()}")
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return DeviceAbsent(
            f"there is no serial port {name}; plug the light box in, or correct the light driver's "
            f"'port'"
        )
    return DeviceError(f"the serial port {name} cannot be opened: {error}")


def _fits(port: Any, options: SerialOptions) -> bool:
    return (
        options.usb_id in (None, f"{port.vid:04x}:{port.pid:04x}")
        and options.usb_serial in (None, port.serial_number)
        and options.port_path in (None, _path_of(port))
    )


def _path_of(port: Any) -> str | None:
    return str(port.location or "").partition(":")[0] or None


def _list(ports: list[Any]) -> str:
    return ", ".join(
        f"{port.device} ({port.vid:04x}:{port.pid:04x}, "
        f"serial number {port.serial_number or 'none'}, port path {port.location or 'unknown'})"
        for port in ports
    )
