"""JPEG images in an HTTP stream of the type ``multipart/x-mixed-replace`` ("MJPEG")."""

from __future__ import annotations

import re
from dataclasses import dataclass

from tactile_core.formats.headers import is_complete

MAX_PART_BYTES = 1 << 26  # Largest image of a stream, bytes; a JPEG of 50 megapixels is smaller

_MAX_HEADER_BYTES = 1 << 14  # Largest header of an image; anything longer is no header

_BLANK_LINE = re.compile(rb"\r?\n\r?\n")  # End of a header

_JPEG = b"\xff\xd8\xff"  # First bytes of a JPEG

_JPEG_END = b"\xff\xd9"  # Last bytes of a JPEG


@dataclass(frozen=True)
class Part:
    """One part of a stream.

    Attributes
    ----------
    headers : dict of str to str
        Names in lower case.
    body : bytes
        The image; it may be damaged.
    """

    headers: dict[str, str]
    body: bytes


class MjpegParser:
    """Splits a stream into images, and finds the next one after anything that is none.

    Content lengths are optional and may be wrong: a part ends at the next boundary at the latest,
    and one without a length as soon as its JPEG is complete.

    Parameters
    ----------
    boundary : str
        From the stream's content type, with or without the dashes in front.
    """

    def __init__(self, boundary: str) -> None:
        self._delimiter = b"--" + boundary.encode("latin-1", "replace").lstrip(b"-")
        self._buffer = b""
        self._headers: dict[str, str] | None = None
        self._inside = False

    def feed(self, data: bytes) -> list[Part]:
        """Add received bytes; return the parts that they complete."""
        self._buffer += data
        parts: list[Part] = []
        while self._advance(parts):
            pass
        return parts

    def _advance(self, parts: list[Part]) -> bool:
        """Go to the next boundary, over a header or over an image; False if bytes are missing."""
        if not self._inside:
            return self._seek()
        if self._headers is None:
            return self._read_headers()
        return self._read_body(self._headers, parts)

    def _seek(self) -> bool:
        at = self._buffer.find(self._delimiter)
        if at < 0:
            self._buffer = self._buffer[1 - len(self._delimiter) :]
            return False
        self._buffer = self._buffer[at + len(self._delimiter) :]
        self._inside, self._headers = True, None
        return True

    def _read_headers(self) -> bool:
        end = _BLANK_LINE.search(self._buffer, 0, _MAX_HEADER_BYTES)
        head = self._buffer if end is None else self._buffer[: end.start()]
        if self._delimiter in head or (end is None and len(head) > _MAX_HEADER_BYTES):
            self._inside = False
            return True
        if end is None:
            return False
        pairs = (line.partition(b":") for line in head.splitlines())
        self._headers = {
            name.strip().lower().decode("latin-1"): value.strip().decode("latin-1")
            for name, colon, value in pairs
            if colon
        }
        self._buffer = self._buffer[end.end() :]
        return True

    def _read_body(self, headers: dict[str, str], parts: list[Part]) -> bool:
        boundary = self._buffer.find(self._delimiter)
        length = _length(headers)
        if length is not None and len(self._buffer) >= length and not 0 <= boundary < length:
            end = length
        elif boundary >= 0:
            end = boundary
        elif length is None and self._buffer.startswith(_JPEG) and is_complete(self._buffer):
            end = self._buffer.rfind(_JPEG_END) + 2  # half of the next boundary may follow already
        elif len(self._buffer) > MAX_PART_BYTES:
            end = len(self._buffer)
        else:
            return False
        body, self._buffer, self._inside = self._buffer[:end], self._buffer[end:], False
        parts.append(Part(headers, body if end == length else body.rstrip(b"\r\n-")))
        return True


def _length(headers: dict[str, str]) -> int | None:
    text = headers.get("content-length", "")
    length = int(text) if text.isdecimal() and len(text) < 12 else 0
    return length if 0 < length <= MAX_PART_BYTES else None
