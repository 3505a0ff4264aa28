"""The light protocol: its lines, their checksum, and how a box describes itself.

``docs/reference/light-protocol.md`` is the specification.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

VERSION = 1  # Version of the protocol

NAME = "tactile-lights"  # First word by which a box says what it is

FULL = 255  # Level of full brightness

UNASKED = 0  # Number of an answer to no request, or to one whose number was unreadable

_POLYNOMIAL, _TOP_BIT, _BYTE = 0x07, 0x80, 0xFF


class LineError(ValueError):
    """A line is not one of the protocol, or was damaged on its way."""


def checksum(payload: bytes) -> int:
    """CRC-8 with the polynomial x⁸ + x² + x + 1, from 0."""
    total = 0
    for byte in payload:
        total ^= byte
        for _ in range(8):
            total = (total << 1 ^ _POLYNOMIAL if total & _TOP_BIT else total << 1) & _BYTE
    return total


def encode(*words: str | int) -> bytes:
    """Make a line from its words.

    It begins with an end of line as well, so that a damaged end of the previous line costs that
    line only.
    """
    payload = " ".join(map(str, words)).encode("ascii")
    return b"\n%s*%02X\n" % (payload, checksum(payload))


def decode(line: bytes) -> tuple[str, ...]:
    """Return the words of a received line.

    Raises
    ------
    LineError
        It is damaged, or not of this protocol.
    """
    payload, star, digits = line.strip().rpartition(b"*")
    try:
        expected = int(digits, 16)
        words = tuple(payload.decode("ascii").split())
    except ValueError as error:
        raise LineError(f"{line!r} is not of the light protocol") from error
    if not (star and words) or expected != checksum(payload):
        raise LineError(f"{line!r} has the wrong checksum")
    return words


@dataclass(frozen=True)
class BoxInfo:
    """How a box describes itself.

    Attributes
    ----------
    firmware : str
        Version of its firmware.
    serial : str
        Serial number of the box.
    lights : int
        Number of outputs.
    settle_s, watchdog_s : float
        Time that a light takes to settle, and time without a request after which all lights go out.
    """

    firmware: str
    serial: str
    lights: int
    settle_s: float
    watchdog_s: float

    @classmethod
    def of(cls, words: Sequence[str]) -> Self:
        """Read the words of a description.

        Raises
        ------
        LineError
            They describe something else, or a box with another version of the protocol.
        """
        version, name, *rest = (*words, "", "")
        if name != NAME:
            raise LineError(f"describes itself as {' '.join(words)!r}, not as {NAME!r}")
        if version != str(VERSION):
            raise LineError(
                f"speaks version {version} of the light protocol instead of {VERSION}; upload the "
                f"firmware that belongs to this version of tactile-core"
            )
        try:
            firmware, serial, lights, settle_ms, watchdog_ms = rest[:5]
            return cls(firmware, serial, int(lights), int(settle_ms) / 1e3, int(watchdog_ms) / 1e3)
        except ValueError as error:
            raise LineError(f"describes itself incompletely, as {' '.join(words)!r}") from error
