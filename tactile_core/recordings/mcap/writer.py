"""Writes recordings as MCAP: images and maps in Foxglove's schemas, all else as JSON."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.formats.headers import kind_of
from tactile_core.interfaces.recording_format import RecordingFormat
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.mcap.chunks import ChunkedFile
from tactile_core.recordings.mcap.file import McapFile
from tactile_core.recordings.mcap.quantities import (
    COMPRESSED_IMAGE,
    EVENT,
    IMAGE_INFO,
    PROFILE,
    RAW_IMAGE,
    REFERENCES,
    encoding_of,
    mcap_library,
    quantity_messages,
    schema_class,
)
from tactile_core.recordings.session_files import ESSENTIAL, reference_bytes, session_files


class McapWriter(RecordingWriter):
    """Writes an MCAP file, without compression: camera images hardly shrink.

    The session comes first, as attachments, so that a file that was cut off still has it. What no
    image can be read without is repeated whenever the file has grown by half, so that either half
    of it is enough. Each image, event and reading
    is a chunk of its own, so that damage to one costs no other, and is on its way to the disk when
    the call returns.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._file: AppendedFile | None = None
        self._failed = False
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}

    def open(self, session: RecordedSession) -> None:
        """Create the file and write the session; if that fails, there is no file."""
        mcap_library("mcap.records")
        for name in (RAW_IMAGE, COMPRESSED_IMAGE):
            _file_descriptors(name)  # what is missing is reported now, and the first image is fast
        self._session = session
        self._root = f"/tactile/{session.serial or session.sensor}"
        file = self._file = AppendedFile(self.path)
        try:
            self._begin(file)
        except BaseException:
            self._file = None
            file.close()
            self.path.unlink(missing_ok=True)
            raise

    def _begin(self, file: AppendedFile) -> None:
        session = self._session
        version = session.software.get("tactile-core", "")
        self._chunks = ChunkedFile(file, PROFILE, f"tactile-core {version}")
        files = session_files(session)
        self._essential = {name: files[name] for name in ESSENTIAL}
        for name, content in files.items():
            self._attach(name, content)
        self._repeat(file)
        described = {"sensor": session.sensor, "serial": session.serial, "gel": session.gel}
        texts = {key: value for key, value in described.items() if value is not None}
        self._chunks.describe(PROFILE, {**texts, **session.software})

    def write_image(self, recorded: RecordedImage) -> None:
        """Write an image and, before it, the JSON that belongs to it."""
        image, number = recorded.image, recorded.number
        place = f"/exposure_{recorded.exposure_index}" if self._session.exposures > 1 else ""
        time_ns = _nanoseconds(image.wall_time_s or image.timestamp_s)
        info = json.dumps(recorded.describe_image()).encode()
        self.add("camera/info", IMAGE_INFO, time_ns, info, number)
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
        self.add(f"camera{place}", schema, time_ns, content, number)
        self.complete_chunk()

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Write an event on a topic of its own."""
        self.add(f"events/{name}", EVENT, time.time_ns(), json.dumps(values).encode())
        self.complete_chunk()

    def write_reference(self, name: str, reference: Reference) -> None:
        """Write a reference as an attachment."""
        with self._note_failure():
            self._attach(f"{REFERENCES}{name}.npz", reference_bytes(reference))

    def write_reading(self, reading: Reading) -> None:
        """Write the quantities of a reading."""
        frame = reading.frame
        time_ns = _nanoseconds(frame.wall_time_s or frame.timestamp_s)
        for one in quantity_messages(reading, time_ns):
            self.add(one.topic, one.schema, time_ns, one.data, frame.sequence)
        self.complete_chunk()

    def add(self, topic: str, schema: str, time_ns: int, data: bytes, number: int = 0) -> None:
        """Add a message to the chunk that :meth:`complete_chunk` writes.

        Parameters
        ----------
        topic : str
            Below that of the sensor.
        schema : str
        time_ns : int
        data : bytes
        number : int
        """
        with self._note_failure():
            channel = self._channels.get((topic, schema))
            if channel is None:
                channel = self._channels[topic, schema] = self._register_channel(topic, schema)
            self._chunks.add(channel, time_ns, data, number & 0xFFFFFFFF)

    def complete_chunk(self) -> None:
        """Write the messages that were added."""
        assert self._file is not None
        with self._note_failure():
            self._chunks.flush()
            if self._file.tell() > self._repeat_at:
                self._repeat(self._file)

    def check(self) -> None:
        """Check that the file still has a name."""
        assert self._file is not None
        self._file.check()

    def close(self) -> None:
        """Write the index, unless writing has failed, and close the file."""
        if self._file is None:
            return
        file, self._file = self._file, None
        try:
            if not self._failed:
                file.check()
                self._repeat(file)
                self._chunks.finish()
        finally:
            file.close()

    def abandon(self) -> None:
        """Close the file as it is, without an index."""
        self._failed = True
        self.close()

    @contextmanager
    def _note_failure(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._failed = True
            raise

    def _attach(self, name: str, content: bytes) -> None:
        self._chunks.attach(time.time_ns(), name, _media_type(name), content)

    def _repeat(self, file: AppendedFile) -> None:
        """Write again what no image can be read without, and plan when to do so next."""
        for name, content in self._essential.items():
            self._attach(name, content)
        self._repeat_at = file.tell() * 3 // 2

    def _register_channel(self, topic: str, schema: str) -> int:
        protobuf = schema.startswith("foxglove.")
        if schema not in self._schemas:
            content = _file_descriptors(schema) if protobuf else b'{"type": "object"}'
            encoding = "protobuf" if protobuf else "jsonschema"
            self._schemas[schema] = self._chunks.register_schema(schema, encoding, content)
        name = f"{self._root}/{topic}"
        encoding = "protobuf" if protobuf else "json"
        return self._chunks.register_channel(name, encoding, self._schemas[schema])


class McapFormat(RecordingFormat):
    """MCAP files."""

    def write(self, path: Path) -> McapWriter:
        """Return the writer of a file."""
        return McapWriter(path)

    def read(self, path: Path) -> McapFile:
        """Open a file."""
        return McapFile(path)


@cache
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
