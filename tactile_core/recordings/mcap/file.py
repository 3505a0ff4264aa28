"""Reads recordings in MCAP files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.errors import InputError
from tactile_core.formats.images import decode_image
from tactile_core.quantities import Image, Pixels, Reference
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    FOOTER,
    MESSAGE,
    MESSAGE_HEADER,
    SCHEMA,
    McapRecords,
    Place,
    Record,
    text_at,
)
from tactile_core.recordings.mcap.topics import (
    COMPRESSED_IMAGE,
    EVENT,
    IMAGE_INFO,
    RAW_IMAGE,
    REFERENCES,
    form_of,
    schema_class,
)
from tactile_core.recordings.recording_file import (
    EventEntry,
    ImageEntry,
    RecordingFile,
    recorded_image,
)
from tactile_core.recordings.session_files import reference_from, session_of

_MOST_SMALL_BYTES = 1 << 20
"""Largest event, bytes."""


class McapFile(RecordingFile):
    """A recording in an MCAP file.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        It is not an MCAP file, or no sensor recorded it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._records = McapRecords(path)
        self._attachments: dict[str, Place] = {}
        self._topics: dict[int, tuple[str, str]] = {}
        self._schemas: dict[int, str] = {}
        self.finished = False
        try:
            self.entries = tuple(self._found())
        except (ValueError, LookupError, RecursionError) as error:
            raise InputError(
                f"{path} is damaged in the middle; copy it again, or use another copy"
            ) from error
        own = {name: p for name, p in self._attachments.items() if not name.startswith(REFERENCES)}
        files = {name: self._records.content(place) for name, place in own.items()}
        self.session = session_of(files, path)

    def close(self) -> None:
        """Close the file."""
        self._records.close()

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        place, schema = entry.place
        content = self._records.content(place)[MESSAGE_HEADER.size :]
        name = f"image {entry.described.get('number')} of {self.path}"
        encoded: bytes | None = None
        try:
            message = schema_class(schema).FromString(content)
            if schema == COMPRESSED_IMAGE:
                encoded = message.data
                pixels = decode_image(message.data, name)
            else:
                pixels = _pixels(message)
        except InputError:
            raise
        except Exception as error:  # the library raises errors of its own
            raise InputError(f"{name} is damaged; copy the recording again") from error
        return recorded_image(pixels, entry, encoded)

    def reference(self, name: str) -> Reference:
        """Read the reference of this name."""
        place = self._attachments.get(f"{REFERENCES}{name}.npz")
        if place is None:
            raise InputError(f"the reference {name} in {self.path} is missing; give --reference")
        return reference_from(self._records.content(place), self.path)

    def _found(self) -> Iterator[ImageEntry | EventEntry]:
        infos: dict[int, Mapping[str, Any]] = {}
        for record in self._records:
            if record.kind == MESSAGE:
                header = self._records.start_of(record.place, MESSAGE_HEADER.size)
                channel, number, _, _ = MESSAGE_HEADER.unpack(header)
                schema, topic = self._topics[channel]
                if schema == IMAGE_INFO:
                    infos[number] = self._json(record)
                elif schema in (RAW_IMAGE, COMPRESSED_IMAGE) and number in infos:
                    if "/camera" in topic:
                        yield ImageEntry(infos.pop(number), (record.place, schema))
                elif schema == EVENT:
                    yield EventEntry(topic.rpartition("/")[2], self._json(record))
            else:
                self._note(record)

    def _note(self, record: Record) -> None:
        kind, place = record
        if kind == FOOTER:
            self.finished = True
        elif kind == SCHEMA:
            content = self._records.start_of(place, _MOST_SMALL_BYTES)
            self._schemas[int.from_bytes(content[:2], "little")] = text_at(content, 2)[0]
        elif kind == CHANNEL:
            content = self._records.start_of(place, _MOST_SMALL_BYTES)
            number, schema = int.from_bytes(content[:2], "little"), content[2:4]
            name = self._schemas.get(int.from_bytes(schema, "little"), "")
            self._topics[number] = name, text_at(content, 4)[0]
        elif kind == ATTACHMENT:
            content = self._records.start_of(place, _MOST_SMALL_BYTES)
            name, at = text_at(content, 16)
            _, at = text_at(content, at)
            length = int.from_bytes(content[at : at + 8], "little")
            self._attachments[name] = Place(-1, place.start + at + 8, length)

    def _json(self, record: Record) -> Mapping[str, Any]:
        if record.place.length > _MOST_SMALL_BYTES:
            raise ValueError("an event is too large")
        values = json.loads(self._records.content(record.place)[MESSAGE_HEADER.size :])
        if not isinstance(values, dict):
            raise ValueError("an event is not a JSON object")
        return values


def _pixels(message: Any) -> Pixels:
    form = form_of(message.encoding)
    if form is None:
        raise ValueError(f"unknown encoding {message.encoding!r}")
    channels, depth = form
    shape = (message.height, message.width, channels)[: 2 if channels == 1 else 3]
    stored = np.frombuffer(message.data, f"<u{depth}").reshape(shape)
    return stored.astype(stored.dtype.newbyteorder("="), copy=False)
