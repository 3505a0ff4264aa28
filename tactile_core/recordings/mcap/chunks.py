"""Writes MCAP files whose every chunk can be read without the others.

A chunk repeats the schemas and channels of its messages, so that damage elsewhere costs none of
them. The format is described at https://mcap.dev/spec.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.mcap.quantities import mcap_library
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    CHUNK_HEADER,
    CHUNK_INDEX,
    FOOTER,
    FOOTER_CONTENT,
    MAGIC,
    MESSAGE,
    MESSAGE_HEADER,
    METADATA,
    RECORD,
    SCHEMA,
    STATISTICS,
)

_INDEXES = {ATTACHMENT: 10, METADATA: 13}  # Kinds of the records that list these kinds


class _Message(NamedTuple):
    channel: int
    time_ns: int
    head: bytes
    data: bytes


class ChunkedFile:
    """An MCAP file that is being written, without compression.

    Parameters
    ----------
    file : AppendedFile
        New.
    profile, software : str
        For the header.
    """

    def __init__(self, file: AppendedFile, profile: str, software: str) -> None:
        self._file = file
        self._kinds = mcap_library("mcap.records")
        self._builder = mcap_library("mcap.data_stream").RecordBuilder
        self._schemas: list[bytes] = []
        self._channels: list[tuple[int, bytes]] = []
        self._waiting: list[_Message] = []
        self._counts: dict[int, int] = {}
        self._times_ns: tuple[int, int] | None = None
        # records of hours of images: bytes take a tenth of the memory of objects
        self._listed = {kind: bytearray() for kind in (CHUNK_INDEX, *_INDEXES.values())}
        self._numbers = dict.fromkeys(self._listed, 0)
        file.write(MAGIC + self._record(self._kinds.Header(profile, software)))

    def attach(self, time_ns: int, name: str, media_type: str, content: bytes) -> None:
        """Write an attachment."""
        times = {"create_time": time_ns, "log_time": time_ns}
        about = {**times, "name": name, "media_type": media_type}
        written = self._record(self._kinds.Attachment(**about, data=content))
        place = {"offset": self._file.tell(), "length": len(written)}
        index = self._kinds.AttachmentIndex(**place, **about, data_size=len(content))
        self._file.write(written)
        self._list(_INDEXES[ATTACHMENT], index)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Write names and values for people."""
        written = self._record(self._kinds.Metadata(name=name, metadata=dict(values)))
        place = {"offset": self._file.tell(), "length": len(written)}
        self._file.write(written)
        self._list(_INDEXES[METADATA], self._kinds.MetadataIndex(**place, name=name))

    def register_schema(self, name: str, encoding: str, definition: bytes) -> int:
        """Return the number of a new schema."""
        number = len(self._schemas) + 1
        schema = self._kinds.Schema(id=number, data=definition, encoding=encoding, name=name)
        self._schemas.append(self._record(schema))
        return number

    def register_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Return the number of a new channel."""
        number = len(self._channels) + 1
        channel = self._kinds.Channel(
            id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata={}
        )
        self._channels.append((schema, self._record(channel)))
        return number

    def add(self, channel: int, time_ns: int, data: bytes, number: int) -> None:
        """Add a message to the chunk that :meth:`flush` writes."""
        length = MESSAGE_HEADER.size + len(data)
        header = MESSAGE_HEADER.pack(channel, number, time_ns, time_ns)
        head = RECORD.pack(MESSAGE, length) + header
        self._waiting.append(_Message(channel, time_ns, head, data))

    def flush(self) -> None:
        """Write the messages that were added as a chunk, whole or not at all.

        Raises
        ------
        OSError
            The disk is full.
        """
        if not self._waiting:
            return
        waiting, self._waiting = self._waiting, []
        entries: dict[int, list[tuple[int, int]]] = {one.channel: [] for one in waiting}
        used = [self._channels[channel - 1] for channel in entries]
        pieces = [self._schemas[number - 1] for number in dict.fromkeys(s for s, _ in used)]
        pieces += [channel for _, channel in used]
        size = sum(map(len, pieces))
        for one in waiting:
            entries[one.channel].append((one.time_ns, size))
            pieces += [one.head, one.data]
            size += len(one.head) + len(one.data)
        checksum = 0
        for piece in pieces:
            checksum = zlib.crc32(piece, checksum)
        times_ns = [one.time_ns for one in waiting]
        span_ns = min(times_ns), max(times_ns)
        header = CHUNK_HEADER.pack(*span_ns, size, checksum, 0) + size.to_bytes(8, "little")
        header = RECORD.pack(CHUNK, len(header) + size) + header
        begin, length = self._file.tell(), len(header) + size
        indexes, places = b"", dict[int, int]()
        for channel, listed in entries.items():
            places[channel] = begin + length + len(indexes)
            indexes += self._record(self._kinds.MessageIndex(channel, listed))
        self._file.write(b"".join([header, *pieces, indexes]))
        index = self._kinds.ChunkIndex(
            chunk_start_offset=begin,
            chunk_length=length,
            message_start_time=span_ns[0],
            message_end_time=span_ns[1],
            message_index_offsets=places,
            message_index_length=len(indexes),
            compression="",
            compressed_size=size,
            uncompressed_size=size,
        )
        self._list(CHUNK_INDEX, index)
        for channel, listed in entries.items():
            self._counts[channel] = self._counts.get(channel, 0) + len(listed)
        first, last = self._times_ns or span_ns
        self._times_ns = min(first, span_ns[0]), max(last, span_ns[1])

    def finish(self) -> None:
        """Write what waits, and the summary."""
        self.flush()
        groups = {
            SCHEMA: b"".join(self._schemas),
            CHANNEL: b"".join(channel for _, channel in self._channels),
            STATISTICS: self._record(self._statistics()),
            **{kind: bytes(records) for kind, records in self._listed.items()},
        }
        end = self._record(self._kinds.DataEnd(0))
        start = self._file.tell() + len(end)
        summary, offsets = b"", b""
        for kind, records in groups.items():
            at = start + len(summary)
            offsets += self._record(self._kinds.SummaryOffset(kind, at, len(records)))
            summary += records
        offsets_at = start + len(summary)
        summary += offsets + RECORD.pack(FOOTER, FOOTER_CONTENT.size)
        summary += FOOTER_CONTENT.pack(start, offsets_at, 0)[:-4]
        checksum = zlib.crc32(summary).to_bytes(4, "little")
        self._file.write(end + summary + checksum + MAGIC)

    def _statistics(self) -> Any:
        first, last = self._times_ns or (0, 0)
        return self._kinds.Statistics(
            message_count=sum(self._counts.values()),
            channel_message_counts=self._counts,
            message_start_time=first,
            message_end_time=last,
            schema_count=len(self._schemas),
            channel_count=len(self._channels),
            attachment_count=self._numbers[_INDEXES[ATTACHMENT]],
            metadata_count=self._numbers[_INDEXES[METADATA]],
            chunk_count=self._numbers[CHUNK_INDEX],
        )

    def _list(self, kind: int, index: Any) -> None:
        self._listed[kind] += self._record(index)
        self._numbers[kind] += 1

    def _record(self, record: Any) -> bytes:
        builder = self._builder()
        record.write(builder)
        return bytes(builder.end())
