"""``core.serial_leds``: a box of LEDs at a serial port, such as an Arduino."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel

from tactile_core.builtin.leds.led_box import LedBox, Link
from tactile_core.builtin.leds.serial_link import SerialLink
from tactile_core.builtin.leds.serial_port import SerialOptions, find_port, open_port
from tactile_core.errors import DeviceError


class SerialLeds(LedBox):
    """Sets the lights of a box with the light protocol over a serial port.

    Opening takes as long as an Arduino takes to start, at most 4 s. A box that does not answer is
    an error after ``timeout_s``.
    """

    Options: ClassVar[type[BaseModel]] = SerialOptions

    def __init__(self, options: SerialOptions) -> None:
        super().__init__(options)
        self._where = options

    def _connect(self) -> Link:
        try:
            import serial  # noqa: F401
        except ImportError as error:
            raise DeviceError(
                "core.serial_leds needs pyserial; run: pip install 'tactile-core[serial]'"
            ) from error
        name, timeout_s = find_port(self._where), self._where.timeout_s
        return SerialLink(open_port(name, timeout_s), name, timeout_s)
