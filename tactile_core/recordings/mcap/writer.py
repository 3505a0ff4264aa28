"""Writes recordings as MCAP: images and maps in Foxglove's schemas, all else as JSON."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.formats.headers import kind_of
from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.mcap.quantities import quantity_messages
from tactile_core.recordings.mcap.topics import (
    COMPRESSED_IMAGE,
    EVENT,
    IMAGE_INFO,
    PROFILE,
    RAW_IMAGE,
    REFERENCES,
    encoding_of,
    mcap_library,
    schema_class,
)
from tactile_core.recordings.recorder import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.recordings.session_files import reference_bytes, session_files

_CHUNK_BYTES = 1 << 20
"""Size from which a chunk is complete; larger ones hardly save time, and more is lost with one."""

_ANY_OBJECT = b'{"type": "object"}'
"""JSON schema of an object with any keys."""


class McapWriter(RecordingWriter):
    """Writes an MCAP file, without compression: camera images hardly shrink.

    The session comes first, as attachments, so that a file that was cut off still has it.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._file: AppendedFile | None = None
        self._failed = False
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def open(self, session: RecordedSession) -> None:
        """Create the file and write the session."""
        library = mcap_library("mcap.writer")
        for name in (RAW_IMAGE, COMPRESSED_IMAGE):
            schema_class(name)  # what is missing is reported now
        self._session = session
        self._root = f"/tactile/{session.serial or session.sensor}"
        self._file = AppendedFile(self.path)
        self._writer: Any = library.Writer(
            self._file, chunk_size=_CHUNK_BYTES, compression=library.CompressionType.NONE
        )
        self._writer.start(PROFILE, f"tactile-core {session.software.get('tactile-core', '')}")
        now_ns = time.time_ns()
        for name, content in session_files(session).items():
            self._writer.add_attachment(now_ns, now_ns, name, _media_type(name), content)
        described = {"sensor": session.sensor, "serial": session.serial, "gel": session.gel}
        texts = {key: value for key, value in described.items() if value is not None}
        self._writer.add_metadata(PROFILE, {**texts, **session.software})
        self._guarded_flush()

    def write_image(self, recorded: RecordedImage) -> None:
        """Write an image and, before it, the JSON that belongs to it."""
        image, number = recorded.image, recorded.number
        place = f"/exposure_{recorded.exposure_index}" if self._session.exposures > 1 else ""
        time_ns = _nanoseconds(image.wall_time_s or image.timestamp_s)
        info = json.dumps(recorded.described()).encode()
        self._add("camera/info", IMAGE_INFO, time_ns, info, number)
        if image.encoded is not None:
            kind = kind_of(image.encoded) or "unknown"
            message = schema_class(COMPRESSED_IMAGE)(format=kind, frame_id="camera")
            schema, data = COMPRESSED_IMAGE, memoryview(image.encoded)
        else:
            assert isinstance(image, Image)
            height, width = image.pixels.shape[:2]
            data = _little_endian(image)
            schema = RAW_IMAGE
            message = schema_class(RAW_IMAGE)(
                width=width,
                height=height,
                encoding=encoding_of(image),
                step=data.nbytes // height,
                frame_id="camera",
            )
        message.timestamp.FromNanoseconds(time_ns)
        content = _with_data(message, data)
        self._add(f"camera{place}", schema, time_ns, content, number)

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Write an event on a topic of its own."""
        self._add(f"events/{name}", EVENT, time.time_ns(), json.dumps(values).encode())

    def write_reference(self, name: str, reference: Reference) -> None:
        """Write a reference as an attachment."""
        now_ns, content = time.time_ns(), reference_bytes(reference)
        name = f"{REFERENCES}{name}.npz"
        self._writer.add_attachment(now_ns, now_ns, name, _media_type(name), content)

    def write_reading(self, reading: Reading) -> None:
        """Write the quantities of a reading."""
        frame = reading.frame
        time_ns = _nanoseconds(frame.wall_time_s or frame.timestamp_s)
        for one in quantity_messages(reading, time_ns):
            self._add(one.topic, one.schema, time_ns, one.data, frame.sequence)

    def flush(self) -> None:
        """Complete the chunk."""
        self._guarded_flush()

    def close(self) -> None:
        """Write the index, unless writing has failed, and close the file."""
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            if not self._failed:
                self._writer.finish()
        finally:
            file.close()

    def _guarded_flush(self) -> None:
        try:
            self._writer.flush()
        except BaseException:
            self._failed = True
            raise

    def _add(self, topic: str, schema: str, time_ns: int, data: bytes, number: int = 0) -> None:
        channel = self._channels.get(topic)
        try:
            if channel is None:
                channel = self._channels[topic] = self._registered(topic, schema)
            self._writer.add_message(channel, time_ns, data, time_ns, number & 0xFFFFFFFF)
        except BaseException:
            self._failed = True
            raise

    def _registered(self, topic: str, schema: str) -> int:
        protobuf = schema.startswith("foxglove.")
        if schema not in self._schemas:
            content = _file_descriptors(schema) if protobuf else _ANY_OBJECT
            encoding = "protobuf" if protobuf else "jsonschema"
            self._schemas[schema] = self._writer.register_schema(schema, encoding, content)
        name = f"{self._root}/{topic}"
        encoding = "protobuf" if protobuf else "json"
        return int(self._writer.register_channel(name, encoding, self._schemas[schema]))


def _file_descriptors(schema: str) -> bytes:
    """Return the definition of a schema with everything that it imports."""
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    found = FileDescriptorSet()
    known: set[str] = set()

    def add(file: Any) -> None:
        if file.name not in known:
            known.add(file.name)
            for needed in file.dependencies:
                add(needed)
            file.CopyToProto(found.file.add())

    add(schema_class(schema).DESCRIPTOR.file)
    return bytes(found.SerializeToString())


def _with_data(message: Any, data: memoryview) -> bytes:
    """Return a message of an image with its ``data``, which is copied only once.

    Fields of a serialised message may follow each other in any order.
    """
    number = message.DESCRIPTOR.fields_by_name["data"].number
    left, length = data.nbytes, bytearray()
    while left > 0x7F:  # seven bits a byte, the lowest first
        length.append(left & 0x7F | 0x80)
        left >>= 7
    length.append(left)
    key = bytes([number << 3 | 2])  # 2: bytes of this length follow
    return b"".join((message.SerializeToString(), key, length, data))


def _little_endian(image: Image) -> memoryview:
    pixels = np.ascontiguousarray(image.pixels)
    return memoryview(pixels.astype(pixels.dtype.newbyteorder("<"), copy=False).data).cast("B")


def _media_type(name: str) -> str:
    kinds = {"json": "application/json", "yaml": "application/yaml", "html": "text/html"}
    return kinds.get(name.rpartition(".")[2], "application/octet-stream")


def _nanoseconds(seconds: float) -> int:
    return max(0, round(seconds * 1e9))
