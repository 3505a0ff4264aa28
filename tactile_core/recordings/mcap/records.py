"""Finds the complete records of an MCAP file, also of one that is cut off or still growing.

Only the headers of records are read, so that a recording of any length is opened without loading
its images. The format is described at https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import regular
from tactile_core.recordings.mcap.topics import mcap_library

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""

FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, ATTACHMENT, METADATA = 2, 3, 4, 5, 6, 9, 12
"""Kinds of records."""

MESSAGE_HEADER = struct.Struct("<HIQQ")
"""Beginning of a message: channel, sequence, and the times at which it was logged and published."""

_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_Read = Callable[[int, int], bytes]
_MOST_BYTES = 1 << 30
"""Largest record that is read into memory, and largest content of a compressed chunk."""


class Place(NamedTuple):
    """Where a record's content is.

    Attributes
    ----------
    chunk : int
        Offset of the compressed chunk that holds it; -1 if it is in the file itself.
    start, length : int
        Offset and size, bytes, in the file or in the chunk's content.
    """

    chunk: int
    start: int
    length: int


class Record(NamedTuple):
    """A complete record.

    Attributes
    ----------
    kind : int
    place : Place
        Of its content.
    """

    kind: int
    place: Place


class McapRecords:
    """The complete records of a file, in order.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        The file is not an MCAP file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] = regular(path).open("rb", buffering=4096)
        weakref.finalize(self, self._file.close).atexit = False
        self._size = self._file.seek(0, 2)
        self._chunk: tuple[int, bytes] = (-1, b"")
        if self.read_at(0, len(MAGIC)) != MAGIC[: self._size] or not self._size:
            self._file.close()
            raise InputError(f"{path} is not an MCAP file; check the path")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def read_at(self, start: int, length: int) -> bytes:
        """Read a part of the file."""
        self._file.seek(start)
        return self._file.read(length)

    def content(self, place: Place) -> bytes:
        """Read the content of a record.

        Raises
        ------
        InputError
            It is damaged.
        """
        if place.length > _MOST_BYTES:
            raise self._damaged()
        if place.chunk < 0:
            found = self.read_at(place.start, place.length)
        else:
            found = self._chunk_at(place.chunk)[place.start : place.start + place.length]
        if len(found) != place.length:
            raise self._damaged()
        return found

    def start_of(self, place: Place, length: int) -> bytes:
        """Read the first bytes of a record's content."""
        return self.content(place._replace(length=min(length, place.length)))

    def __iter__(self) -> Iterator[Record]:
        """Yield the records, and those of a chunk in its place."""
        at, size = len(MAGIC), self._size
        while at + _RECORD.size <= size:
            kind, length = _RECORD.unpack(self.read_at(at, _RECORD.size))
            start = at + _RECORD.size
            if kind == CHUNK:
                yield from self._chunk_records(start, min(start + length, size))
            elif start + length <= size:
                yield Record(kind, Place(-1, start, length))
            at = start + length

    def _chunk_records(self, start: int, end: int) -> Iterator[Record]:
        """Yield the complete records of a chunk, whose end may be missing."""
        content, compression = self._chunk_header(start)
        if content > end:
            return
        if not compression:
            yield from self._inside(-1, content, end, self.read_at)
            return
        length = int.from_bytes(self.read_at(content - 8, 8), "little")
        if content + length <= end:  # a part of a compressed chunk cannot be read
            data = self._chunk_at(start)
            yield from self._inside(start, 0, len(data), lambda at, n: data[at : at + n])

    def _inside(self, chunk: int, at: int, end: int, read: _Read) -> Iterator[Record]:
        while at + _RECORD.size <= end:
            kind, length = _RECORD.unpack(read(at, _RECORD.size))
            at += _RECORD.size
            if at + length > end:
                return
            yield Record(kind, Place(chunk, at, length))
            at += length

    def _chunk_header(self, start: int) -> tuple[int, str]:
        """Return where the content of a chunk begins, and its compression."""
        header = self.read_at(start, _CHUNK.size + 32)
        if len(header) < _CHUNK.size:
            return self._size + 1, ""
        length = _CHUNK.unpack_from(header)[4]
        name = header[_CHUNK.size : _CHUNK.size + length]
        return start + _CHUNK.size + length + 8, name.decode("ascii", "replace")

    def _chunk_at(self, start: int) -> bytes:
        if self._chunk[0] != start:
            content, compression = self._chunk_header(start)
            length = int.from_bytes(self.read_at(content - 8, 8), "little")
            plain_bytes = _CHUNK.unpack(self.read_at(start, _CHUNK.size))[2]
            if max(length, plain_bytes) > _MOST_BYTES:
                raise self._damaged()
            self._chunk = start, self._decompressed(compression, self.read_at(content, length))
        return self._chunk[1]

    def _decompressed(self, compression: str, data: bytes) -> bytes:
        try:
            if compression == "lz4":
                return bytes(mcap_library("lz4.frame").decompress(data))
            if compression == "zstd":
                decompressor = mcap_library("zstandard").ZstdDecompressor()
                return bytes(decompressor.decompress(data, max_output_size=_MOST_BYTES))
        except InputError:
            raise
        except Exception as error:  # the libraries raise errors of their own
            raise self._damaged() from error
        raise self._damaged()

    def _damaged(self) -> InputError:
        return InputError(f"{self._path} is damaged; copy it again, or use another copy")


def text_at(content: bytes, at: int) -> tuple[str, int]:
    """Return the text at an offset of a record's content, and the offset of what follows.

    Raises
    ------
    ValueError
        The content is too short, or not text.
    """
    end = at + 4 + int.from_bytes(content[at : at + 4], "little")
    if end > len(content):
        raise ValueError("the text is truncated")
    return content[at + 4 : end].decode(), end
