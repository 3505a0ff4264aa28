"""Reads an HDF5 file whose writer was killed, or whose end is missing, as far as it goes.

HDF5 refuses a file whose header says that somebody writes it, and one that is shorter than its
header says. Here the header that HDF5 reads says neither, and bytes that are missing are an error
only if they are needed.
"""

from __future__ import annotations

import io
from pathlib import Path

HEADER_BYTES = 48
"""Size of the header (superblock of version 3), bytes."""

_SIGNATURE, _VERSION, _VERSION_AT = b"\x89HDF\r\n\x1a\n", 3, 8
_FLAGS, _END_OF_FILE, _CHECKSUM = 11, slice(28, 36), slice(44, 48)
"""Where the header has its fields."""

_BEING_WRITTEN = 1
"""Bit of the flags."""

_WORD = 0xFFFFFFFF


class IncompleteFile(io.RawIOBase):
    """A file of bytes for HDF5, with a header that says that it is complete.

    Parameters
    ----------
    path : Path

    Raises
    ------
    ValueError
        It does not begin with a header of this version.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = path.open("rb")
        header = bytearray(self._file.read(HEADER_BYTES))
        if not is_header(header):
            self._file.close()
            raise ValueError("it has no header")
        self._there = self._file.seek(0, io.SEEK_END)
        self._size = max(self._there, end_of_file(header))
        header[_FLAGS] = 0
        header[_CHECKSUM] = lookup3(header[: _CHECKSUM.start]).to_bytes(4, "little")
        self._header = bytes(header)
        self._at = 0

    def readable(self) -> bool:
        """Whether it can be read: yes."""
        return True

    def seekable(self) -> bool:
        """Whether any place can be read next: yes."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Choose what is read next, relative to the beginning, this place or the end."""
        self._at = (0, self._at, self._size)[whence] + offset
        return self._at

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill a buffer.

        Raises
        ------
        EOFError
            Some of these bytes are missing.
        """
        begin, end = self._at, self._at + len(buffer)
        if end > self._there:
            raise EOFError("the file is truncated")
        self._file.seek(begin)
        data = bytearray(self._file.read(len(buffer)))
        if begin < HEADER_BYTES:
            of_header = self._header[begin:end]
            data[: len(of_header)] = of_header
        buffer[:] = data
        self._at = end
        return len(data)

    def close(self) -> None:
        """Close the file; may be called twice."""
        self._file.close()
        super().close()


def is_header(data: bytes | bytearray) -> bool:
    """Whether these bytes are the header of an HDF5 file of version 3."""
    right = data.startswith(_SIGNATURE) and len(data) == HEADER_BYTES
    return right and data[_VERSION_AT] == _VERSION


def is_being_written(header: bytes | bytearray) -> bool:
    """Whether a header says that the file was not closed."""
    return bool(header[_FLAGS] & _BEING_WRITTEN)


def end_of_file(header: bytes | bytearray) -> int:
    """Return the size of the file, bytes, as its header says."""
    return int.from_bytes(header[_END_OF_FILE], "little")


def lookup3(data: bytes | bytearray) -> int:
    """Return the checksum of HDF5's metadata.

    Notes
    -----
    Bob Jenkins, lookup3.c (2006), ``hashlittle`` with an initial value of 0.
    """
    a = b = c = (0xDEADBEEF + len(data)) & _WORD
    while len(data) > 12:
        a, b, c = _added(a, b, c, data)
        for turn in (4, 6, 8, 16, 19, 4):
            a = (a - c) & _WORD ^ _rotated(c, turn)
            c = (c + b) & _WORD
            a, b, c = b, c, a
        data = data[12:]
    if not data:
        return c
    a, b, c = _added(a, b, c, data)
    for turn in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _rotated(b, turn)) & _WORD
        a, b, c = b, c, a
    return b


def _added(a: int, b: int, c: int, data: bytes | bytearray) -> tuple[int, int, int]:
    """Add the next 12 bytes, or as many as there are, to the state."""
    words = (int.from_bytes(data[begin : begin + 4], "little") for begin in (0, 4, 8))
    x, y, z = ((old + new) & _WORD for old, new in zip((a, b, c), words, strict=True))
    return x, y, z


def _rotated(word: int, turn: int) -> int:
    return (word << turn | word >> (32 - turn)) & _WORD
