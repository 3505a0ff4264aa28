"""The link to lights on a serial port."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from itertools import cycle
from typing import Any

from pydantic import Field

from tactile_core.builtin.leds.led_box import (
    UNASKED,
    BoxInfo,
    BoxOptions,
    LineError,
    decode,
    encode,
)
from tactile_core.errors import DeviceAbsent, DeviceBusy, DeviceError, DeviceForbidden, LightsLost
from tactile_core.interfaces.device import ConnectedDevice
from tactile_core.interfaces.usb_bus import CLAIM, INSTEAD, holders, name_holders, permission_advice

# [s] Longest wait for the first hello: the bootloader of an Arduino runs for 1 s (Optiboot) or 2 s
# (older ones) after its port is opened
_HELLO_S = 4.0
# [s] Interval at which a box that does not reset is asked for its hello: several times within the
# time of a bootloader, which ends early when it receives something else
_ASK_S = 0.5
# [count] How often a request is sent: the protocol; damage to two lines in a row is a bad cable
_ATTEMPTS = 2


class SerialLink:
    """A box at an open serial port; waits for its hello.

    Parameters
    ----------
    port : serial.Serial
        Open, and closed with the link, or if the hello does not arrive.
    place : str
        The port's name.
    timeout_s : float
        Longest wait for an acknowledgement.

    Raises
    ------
    DeviceError
        No box describes itself at the port, or one with another version of the protocol.
    """

    def __init__(self, port: Any, place: str, timeout_s: float) -> None:
        self.place = place
        self._port = port
        self._timeout_s = timeout_s
        self._numbers = cycle(range(UNASKED + 1, 256))
        self._received = bytearray()
        try:
            self.info = self._hello()
        except BaseException:
            self.close()
            raise

    def set_levels(self, levels: bytes) -> None:
        """Set the level of each output, and return once the lights have settled."""
        self._request("SET", *levels)

    def keep_alive(self) -> None:
        """Keep the lights on."""
        self._request("ALIVE")

    def close(self) -> None:
        """Release the port."""
        with suppress(OSError):  # it was unplugged
            self._port.close()

    def _hello(self) -> BoxInfo:
        """Wait for the hello of a box that starts, and ask one that was running."""
        other = b""
        until = time.monotonic() + _HELLO_S
        while (now := time.monotonic()) < until:
            self._write(encode("HELLO", next(self._numbers)))
            for line in self._lines(min(until, now + _ASK_S)):
                try:
                    words = decode(line)
                except LineError:
                    other = line  # the end of a line, or what a bootloader or another device says
                    continue
                if words[0] == "HELLO":
                    try:
                        return BoxInfo.from_words(words[2:])
                    except LineError as error:
                        raise DeviceError(f"the light box at {self.place} {error}") from error
        said = f"answers {bytes(other[:40])!r}" if other else "does not answer"
        raise DeviceError(
            f"the device at {self.place} {said} and is no box with the light protocol; name the "
            f"right port, or upload the firmware to the Arduino"
        )

    def _request(self, command: str, *levels: int) -> None:
        """Send a request and wait until it is acknowledged; send it again once if need be."""
        numbers: set[str] = set()
        damaged = ""
        for _ in range(_ATTEMPTS):
            number = next(self._numbers)
            numbers.add(str(number))
            self._write(encode(command, number, *levels))
            try:
                if self._await_answer(numbers, time.monotonic() + self._timeout_s / _ATTEMPTS):
                    return
            except LineError as error:
                damaged = f" ({error})"
        raise DeviceError(
            f"the light box at {self.place} does not answer within {self._timeout_s:g} s{damaged}; "
            f"check its cable and power"
        )

    def _await_answer(self, numbers: set[str], until: float) -> bool:
        """Wait for the answer to one of these requests; raise LineError to send it again."""
        for line in self._lines(until):
            kind, number, *reason = (*decode(line), "", "")
            if kind == "HELLO" and number == str(UNASKED):
                raise DeviceError(
                    f"the light box at {self.place} has restarted, and its lights were out; its "
                    f"power supply may be too weak"
                )
            if kind == "ERR" and number == str(UNASKED):
                raise LineError(f"it received a damaged line: {reason[0]}")
            if number not in numbers:
                continue  # late, for an earlier request
            if kind == "OK":
                return True
            raise DeviceError(
                f"the light box at {self.place} refuses: {' '.join(decode(line))}; upload the "
                f"firmware that belongs to this version of tactile-core"
            )
        return False

    def _lines(self, until: float) -> Iterator[bytes]:
        """Yield the lines that arrive until a time."""
        while True:
            while (end := self._received.find(b"\n")) >= 0:
                line = bytes(self._received[:end]).strip()
                del self._received[: end + 1]
                if line:
                    yield line
            del self._received[:-128]  # [bytes] twice the protocol's line
            if time.monotonic() >= until:
                return
            self._received += self._unless_gone(lambda: self._port.read(self._port.in_waiting or 1))

    def _write(self, line: bytes) -> None:
        self._unless_gone(lambda: self._port.write(line))

    def _unless_gone(self, action: Callable[[], Any]) -> Any:
        import serial

        try:
            return action()
        except serial.SerialTimeoutException as error:
            raise DeviceError(
                f"the light box at {self.place} takes nothing within {self._timeout_s:g} s; check "
                f"its cable and power"
            ) from error
        except OSError as error:  # SerialException is one
            raise LightsLost(
                f"the light box at {self.place} was disconnected ({error}); plug it in and open "
                f"the sensor again"
            ) from error


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
            500000,  # [bit/s] the protocol; an Arduino divides its clock to it exactly
            timeout=0.02,  # [s] a small part of the shortest timeout
            write_timeout=timeout_s,
            exclusive=True,
        )
    except (OSError, ValueError) as error:  # SerialException is an OSError
        raise _explain_error(name, error) from error
    with suppress(AttributeError, NotImplementedError, OSError, ValueError):
        port.set_low_latency_mode(True)  # else an FTDI adapter waits 16 ms for more to come
    return port


def _explain_error(name: str, error: OSError | ValueError) -> DeviceError:
    number = getattr(error, "errno", None)
    if number in _BUSY or isinstance(error.__context__, BlockingIOError):
        return DeviceBusy(f"the serial port {name} is in use{name_holders(name)}; close that first")
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
