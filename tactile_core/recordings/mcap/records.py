"""Finds the sound records of an MCAP file, also of one that is cut off, damaged or still growing.

What no right checksum covers is not read: only chunks, attachments and the summary have one. After
something damaged, reading goes on at the next chunk or attachment that is sound. The format is
described at https://mcap.dev/spec.
"""

from __future__ import annotations

import os
import re
import struct
import time
import weakref
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import regular
from tactile_core.recordings.mcap.quantities import mcap_library

MAGIC = b"\x89MCAP0\r\n"  # First and last bytes of a file

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = 1, 2, 3, 4, 5, 6, 7
CHUNK_INDEX, ATTACHMENT, STATISTICS, METADATA, DATA_END = 8, 9, 11, 12, 15  # Kinds of records

DAMAGED = -1  # Kind that stands for a stretch of the file that is left out

RECORD = struct.Struct("<BQ")  # Beginning of a record: kind, and length of its content

# Beginning of a message: channel, sequence, and the times at which it was logged and published.
MESSAGE_HEADER = struct.Struct("<HIQQ")

# Beginning of a chunk: first and last time, plain size, checksum, length of the compression's name.
CHUNK_HEADER = struct.Struct("<QQQII")

# Where the summary and its offsets begin, and the checksum of all of it.
FOOTER_CONTENT = struct.Struct("<QQI")

_LENGTH = struct.Struct("<Q")
_TAIL_BYTES = RECORD.size + FOOTER_CONTENT.size + len(MAGIC)
# Largest record that is read into memory, and largest content of a compressed chunk.
_MOST_BYTES = 1 << 30
# May be a chunk or an attachment: its kind, and the high bytes of its length.
_BEGINNING = re.compile(rb"[\x06\x09](?=[\s\S]{4}[\s\S]\x00\x00\x00)")
_EMPTY_CHUNK_BYTES = CHUNK_HEADER.size + _LENGTH.size


class RecordPlace(NamedTuple):
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


class McapRecord(NamedTuple):
    """A sound record, or :data:`DAMAGED`.

    Attributes
    ----------
    kind : int
    place : RecordPlace
        Of its content.
    content : memoryview
    """

    kind: int
    place: RecordPlace
    content: memoryview


class McapRecords:
    """The sound records of a file, in order.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    finished : bool
        Whether the file ends with a sound summary.
    summary : tuple of McapRecord
        Its records.
    stamp : tuple of int
        Identifies the file and its content, unless it changes within moments.
    age_s : float
        Time since the file changed.
    damaged_places : int
        Stretches that the latest iteration left out. The missing rest of a record at the end of an
        unfinished file is none.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] = regular(path).open("rb", buffering=4096)
        weakref.finalize(self, self._file.close).atexit = False
        found = os.fstat(self._file.fileno())
        self.stamp = found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
        self.age_s = time.time() - max(found.st_mtime, found.st_ctime)
        self._end = self._file.seek(0, 2)
        self._chunk: tuple[int, bytes] = (-1, b"")
        self._sound: set[int] = set()
        self.damaged_places = 0
        self.summary = tuple(self._summary_records())
        self.finished = bool(self.summary)

    @property
    def chunks(self) -> int | None:
        """Number of chunks of a finished file."""
        return len(self._listed_chunks()) if self.finished else None

    @property
    def damaged_chunks(self) -> int | None:
        """Number of chunks of a finished file that the latest iteration left out."""
        return len(self._listed_chunks() - self._sound) if self.finished else None

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def read_at(self, start: int, length: int) -> bytes:
        """Read a part of the file."""
        self._file.seek(start)
        return self._file.read(length)

    def content(self, place: RecordPlace) -> bytes:
        """Read the content of a record that an iteration has found.

        Raises
        ------
        InputError
            The file has changed since.
        """
        found = b""
        if place.chunk < 0:
            found = self.read_at(place.start, place.length)
        else:
            if self._chunk[0] != place.chunk:
                chunk = self._chunk_at(place.chunk)
                self._chunk = place.chunk, b"" if chunk is None else bytes(chunk[2])
            found = self._chunk[1][place.start : place.start + place.length]
        if len(found) != place.length:
            raise InputError(f"{self._path} has changed while it was read; read it again")
        return found

    def __iter__(self) -> Iterator[McapRecord]:
        """Yield attachments, and in the place of a chunk its records."""
        at, self.damaged_places = len(MAGIC), 0
        self._sound.clear()
        while at < self._end:
            kind, end = self._record_at(at)
            if kind == CHUNK and (chunk := self._chunk_at(at)) is not None:
                self._sound.add(at)
                yield from _inside(*chunk)
            elif kind == ATTACHMENT and (attachment := self._attachment_at(at)) is not None:
                yield attachment
            elif kind == DATA_END and end == at + RECORD.size + 4:
                return
            elif not self._is_plain(kind, at, end):
                truncated = end > self._end
                end = self._next_sound(at + 1)
                if self.finished or end < self._end or not truncated:
                    self.damaged_places += 1
                    yield McapRecord(DAMAGED, RecordPlace(-1, at, end - at), memoryview(b""))
            at = end

    def _record_at(self, at: int) -> tuple[int, int]:
        """Return the kind of the record at an offset, and where it ends."""
        header = self.read_at(at, RECORD.size)
        if len(header) < RECORD.size:
            return 0, self._end + 1
        kind, length = RECORD.unpack(header)
        return kind, at + RECORD.size + length

    def _is_plain(self, kind: int, at: int, end: int) -> bool:
        """Whether a record without a checksum, which is not used, has the size that it says."""
        start = at + RECORD.size
        if end > self._end or kind not in (HEADER, METADATA, MESSAGE_INDEX):
            return False
        if kind == MESSAGE_INDEX:
            return end - start == 6 + _number(self.read_at(start + 2, 4))
        before = 4 + _number(self.read_at(start, 4))
        return end - start == before + 4 + _number(self.read_at(start + before, 4))

    def _chunk_at(self, at: int) -> tuple[int, int, memoryview] | None:
        """Return a sound chunk: its offset if it is compressed, where its content is, and that."""
        start = at + RECORD.size
        _, end = self._record_at(at)
        header = self.read_at(start, _EMPTY_CHUNK_BYTES + 32)
        if not _is_chunk(header, end - start) or end > self._end:
            return None
        _, _, plain_bytes, checksum, named = CHUNK_HEADER.unpack_from(header)
        begin = start + _EMPTY_CHUNK_BYTES + named
        if max(end - begin, plain_bytes) > _MOST_BYTES:
            return None
        content = self.read_at(begin, end - begin)
        if named:
            name = header[CHUNK_HEADER.size : CHUNK_HEADER.size + named]
            content = _decompress_chunk(name, content)
        if len(content) != plain_bytes or zlib.crc32(content) != checksum:
            return None
        return (at, 0, memoryview(content)) if named else (-1, begin, memoryview(content))

    def _attachment_at(self, at: int) -> McapRecord | None:
        _, end = self._record_at(at)
        start = at + RECORD.size
        header = self.read_at(start, 1 << 12)  # [bytes] its beginning, with its name
        if not _is_attachment(header, end - start) or end > self._end:
            return None
        content = memoryview(self.read_at(start, end - start))
        if zlib.crc32(content[:-4]) != _number(content[-4:]):
            return None
        return McapRecord(ATTACHMENT, RecordPlace(-1, start, end - start), content)

    def _next_sound(self, at: int) -> int:
        """Return the offset of the next sound chunk or attachment; the end if there is none."""
        while at < self._end:
            block = self.read_at(at, 1 << 22)  # [bytes]
            for found in _BEGINNING.finditer(block):
                begin = at + found.start()
                kind, length = RECORD.unpack_from(block, found.start())
                if begin + RECORD.size + length > self._end:
                    continue
                sound = self._chunk_at if kind == CHUNK else self._attachment_at
                if sound(begin) is not None:
                    return begin
            at += max(1, len(block) - RECORD.size)
        return self._end

    def _summary_records(self) -> Iterator[McapRecord]:
        tail_at = self._end - _TAIL_BYTES
        tail = self.read_at(max(0, tail_at), _TAIL_BYTES)
        if tail[RECORD.size + FOOTER_CONTENT.size :] != MAGIC or tail_at < 0:
            return
        start, _, checksum = FOOTER_CONTENT.unpack_from(tail, RECORD.size)
        length = self._end - len(MAGIC) - 4 - start
        if not RECORD.size + 16 <= length <= min(self._end, _MOST_BYTES):
            return
        content = self.read_at(start, length)
        if zlib.crc32(content) == checksum:
            self._end = start
            records = memoryview(content)[: -RECORD.size - 16]
            yield from _inside(-1, start, records)

    def _listed_chunks(self) -> set[int]:
        """Return the offsets of all chunks of a finished file."""
        listed = (one.content for one in self.summary if one.kind == CHUNK_INDEX)
        return {_LENGTH.unpack_from(content, 16)[0] for content in listed}


def _inside(chunk: int, start: int, content: memoryview) -> Iterator[McapRecord]:
    """Yield the records in a sound chunk or summary."""
    at = 0
    while at + RECORD.size <= len(content):
        kind, length = RECORD.unpack_from(content, at)
        at += RECORD.size
        yield McapRecord(kind, RecordPlace(chunk, start + at, length), content[at : at + length])
        at += length


def _is_chunk(header: bytes, length: int) -> bool:
    """Whether the sizes at the beginning of a chunk agree with each other."""
    if len(header) < _EMPTY_CHUNK_BYTES or length < _EMPTY_CHUNK_BYTES:
        return False
    named = CHUNK_HEADER.unpack_from(header)[4]
    if named > 16:
        return False
    (stored,) = _LENGTH.unpack_from(header, CHUNK_HEADER.size + named)
    return bool(length == _EMPTY_CHUNK_BYTES + named + stored)


def _is_attachment(header: bytes, length: int) -> bool:
    """Whether the sizes at the beginning of an attachment agree with each other."""
    at = 16  # behind its times
    for _ in ("name", "media type"):
        at += 4 + _number(header[at : at + 4])
    stored = _number(header[at : at + 8])
    return at + 8 <= len(header) and length == at + 8 + stored + 4 <= _MOST_BYTES


def _decompress_chunk(compression: bytes, data: bytes) -> bytes:
    """Return the content of a chunk; nothing if it is damaged."""
    try:
        if compression == b"lz4":
            return bytes(mcap_library("lz4.frame").decompress(data))
        if compression == b"zstd":
            decompressor = mcap_library("zstandard").ZstdDecompressor()
            return bytes(decompressor.decompress(data, max_output_size=_MOST_BYTES))
    except InputError:
        raise
    except Exception:  # the libraries raise errors of their own
        return b""
    return b""


def _number(content: bytes | memoryview) -> int:
    return int.from_bytes(content, "little")


def text_at(content: bytes | memoryview, at: int) -> tuple[str, int]:
    """Return the text at an offset of a record's content, and the offset of what follows.

    Raises
    ------
    ValueError
        The content is too short, or not text.
    """
    end = at + 4 + _number(content[at : at + 4])
    if end > len(content):
        raise ValueError("the text is truncated")
    return bytes(content[at + 4 : end]).decode(), end
