"""A light box on USB as its host sees it: descriptors, and answers to control requests.

Only the standard library: the emulator that umockdev needs runs it with the system's Python.
"""

from __future__ import annotations

import struct

STANDARD_IN, GET_DESCRIPTOR, STRING, LANGUAGE = 0x80, 6, 3, b"\x09\x04"


class UsbLightBox:
    """A good box, unless its attributes are changed.

    Attributes
    ----------
    levels : list of list of int
        What it was set to.
    beats : int
        Requests to keep alive.
    settled : bool
        Whether lights settle.
    silent, gone, stalls : bool
        Faults: never answers, was unplugged, refuses.
    """

    def __init__(
        self,
        serial: str = "L0001",
        product: str = "Tactile lights 6",
        ids: tuple[int, int] = (0x16C0, 0x05DC),
        port: int = 2,
        watchdog_ms: int = 400,
    ) -> None:
        self.ids, self.port = ids, port
        self.strings = {1: "example.org", 2: product, 3: serial}
        self.description = f"1 tactile-lights 1.0 {serial} 6 1 {watchdog_ms}"
        self.levels: list[list[int]] = []
        self.beats = 0
        self.status = 0
        self.settled = True
        self.silent = self.gone = self.stalls = False

    @property
    def device_descriptor(self) -> bytes:
        return struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x200, 0, 0, 0, 64, *self.ids, 1, 1, 2, 3, 1)

    @property
    def configuration(self) -> bytes:
        """One configuration with one vendor interface."""
        interface = struct.pack("<9B", 9, 4, 0, 0, 0, 0xFF, 0, 0, 0)
        return struct.pack("<BBHBBBBB", 9, 2, 9 + len(interface), 1, 1, 0, 0x80, 50) + interface

    def control(self, kind: int, request: int, value: int, data: bytes) -> bytes | None:
        """Return the answer to a request; None for a stall."""
        if (kind, request) == (STANDARD_IN, GET_DESCRIPTOR) and value >> 8 == STRING:
            index = value & 0xFF
            text = self.strings[index].encode("utf-16-le") if index else LANGUAGE
            return bytes([len(text) + 2, STRING]) + text
        if self.stalls:
            return None
        match kind, request:
            case (0xC0, 1):
                return self.description.encode()
            case (0x40, 2) if len(data) == 6:
                self.levels.append(list(data))
                if self.settled:
                    self.status = value
                return b""
            case (0xC0, 3):
                return bytes([self.status])
            case (0x40, 4):
                self.beats += 1
                return b""
        return None
