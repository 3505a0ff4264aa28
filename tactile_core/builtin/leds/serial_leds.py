"""``core.serial_leds``: a box of LEDs at a serial port, such as an Arduino."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar

from pydantic import BaseModel

from tactile_core.builtin.leds.led_box import LedBox, Link
from tactile_core.builtin.leds.serial_link import SerialLink
from tactile_core.builtin.leds.serial_port import SerialOptions, find_port, open_port, usb_ports
from tactile_core.errors import LibraryMissing
from tactile_core.interfaces.connected_device import ConnectedDevice


class SerialLeds(LedBox):
    """Sets the lights of a box with the light protocol over a serial port.

    Opening takes as long as an Arduino takes to start, at most 4 s. A box that does not answer is
    an error after ``timeout_s``.
    """

    Options: ClassVar[type[BaseModel]] = SerialOptions
    selectors: ClassVar[Mapping[str, str]] = {
        "usb_id": "usb_id",
        "usb_serial": "serial",
        "port_path": "port_path",
        "port": "place",
    }

    def __init__(self, options: SerialOptions) -> None:
        super().__init__(options)
        self._where = options

    @classmethod
    def connected(cls) -> Iterator[ConnectedDevice]:
        """Yield every USB serial port: asking which is a box would restart an Arduino."""
        _require_library()
        return usb_ports()

    def _connect(self) -> Link:
        _require_library()
        name, timeout_s = find_port(self._where), self._where.timeout_s
        return SerialLink(open_port(name, timeout_s), name, timeout_s)


def _require_library() -> None:
    try:
        import serial  # noqa: F401
    except ImportError as error:
        raise LibraryMissing(
            "core.serial_leds needs pyserial; run: pip install 'tactile-core[serial]'"
        ) from error
