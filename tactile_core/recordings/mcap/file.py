"""Reads recordings in MCAP files."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.errors import InputError
from tactile_core.formats.images import decode_image
from tactile_core.interfaces.recording_format import (
    REFERENCE,
    RESUMED,
    EventEntry,
    ImageEntry,
    RecordingFile,
    recorded_image,
)
from tactile_core.quantities import Image, Pixels, Reference
from tactile_core.recordings.mcap.quantities import (
    COMPRESSED_IMAGE,
    EVENT,
    IMAGE_INFO,
    RAW_IMAGE,
    REFERENCES,
    form_of,
    schema_class,
)
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    DAMAGED,
    MESSAGE,
    MESSAGE_HEADER,
    SCHEMA,
    STATISTICS,
    McapRecord,
    McapRecords,
    RecordPlace,
    text_at,
)
from tactile_core.recordings.session_files import reference_from, session_of

# A channel and the number of its messages, at the end of the statistics.
_COUNT = struct.Struct("<HQ")

# What was read of the last files: a command opens its recording several times.
_KNOWN: dict[tuple[Any, ...], dict[str, Any]] = {}


class McapFile(RecordingFile):
    """A recording in an MCAP file; what is damaged is left out.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        It is not an MCAP file, or no sensor recorded it.

    Attributes
    ----------
    records : McapRecords
    topics : dict of int to (str, str)
        Schema and topic of each channel.
    damaged_places : int
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.records = McapRecords(path)
        key = path, *self.records.stamp
        known = _KNOWN.pop(key, None)
        if known is None:
            self._read(path)
            known = {name: value for name, value in vars(self).items() if name != "records"}
        vars(self).update(known)
        # soon after a change, the next one may have the same time
        if self.records.age_s > 2.0:  # [s] file systems count in seconds at worst
            _KNOWN[key] = known
            for oldest in list(_KNOWN)[:-2]:  # [files]
                del _KNOWN[oldest]

    def _read(self, path: Path) -> None:
        """Read everything but the images, and verify all."""
        self.topics: dict[int, tuple[str, str]] = {}
        self._attachments: dict[str, RecordPlace] = {}
        self._schemas: dict[int, str] = {}
        self._counts: dict[int, int] = {}
        self.finished = self.records.finished
        try:
            for record in self.records.summary:
                self._note(record)
            self.entries = tuple(self._find_entries())
        except (ValueError, LookupError, RecursionError, struct.error) as error:
            raise InputError(
                f"{path} has chunks of another program; save its images as PNG, or use another copy"
            ) from error
        if not self._attachments and not self.entries:
            raise InputError(
                f"{path} is no MCAP recording of tactile, or is damaged throughout; save another "
                f"program's images as PNG, or use another copy"
            )
        own = {name: p for name, p in self._attachments.items() if not name.startswith(REFERENCES)}
        files = {name: self.records.content(place) for name, place in own.items()}
        self.session = session_of(files, path)
        self.damaged_places = self.records.damaged_places
        self.damage = self._damage()

    def close(self) -> None:
        """Close the file."""
        self.records.close()

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        place, schema = entry.place
        content = self.records.content(place)[MESSAGE_HEADER.size :]
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
        return reference_from(self.records.content(place), self.path)

    def _find_entries(self) -> Iterator[ImageEntry | EventEntry]:
        infos: dict[int, Mapping[str, Any]] = {}
        for record in self.records:
            if record.kind == DAMAGED:
                yield EventEntry(RESUMED, {})
            elif record.kind == MESSAGE:
                channel, number, _, _ = MESSAGE_HEADER.unpack_from(record.content)
                schema, topic = self.topics.get(channel, ("", ""))
                if schema == IMAGE_INFO:
                    infos[number] = _json(record)
                elif _is_image(schema, topic) and number in infos:
                    yield ImageEntry(infos.pop(number), (record.place, schema))
                elif schema == EVENT:
                    event = EventEntry(topic.rpartition("/")[2], _json(record))
                    named = f"{REFERENCES}{event.values.get('name')}.npz"
                    # a reference that is there counts from its own place, not from its event
                    if event.name != REFERENCE or named not in self._attachments:
                        yield event
            elif record.kind == ATTACHMENT:
                self._attach(record)
                if (name := later_reference(record)) is not None:
                    yield EventEntry(REFERENCE, {"name": name})
            else:
                self._note(record)

    def _attach(self, record: McapRecord) -> None:
        """Remember where the content of an attachment is."""
        name, at = text_at(record.content, 16)
        _, at = text_at(record.content, at)
        length = int.from_bytes(record.content[at : at + 8], "little")
        self._attachments[name] = RecordPlace(-1, record.place.start + at + 8, length)

    def _note(self, record: McapRecord) -> None:
        """Remember what is needed to read messages."""
        kind, _, content = record
        number = int.from_bytes(content[:2], "little")
        if kind == SCHEMA:
            self._schemas[number] = text_at(content, 2)[0]
        elif kind == CHANNEL:
            schema = self._schemas.get(int.from_bytes(content[2:4], "little"), "")
            self.topics[number] = schema, text_at(content, 4)[0]
        elif kind == STATISTICS:
            self._counts = dict(_COUNT.iter_unpack(content[46:]))

    def _damage(self) -> str:
        records, name = self.records, self.path.name
        read = sum(isinstance(entry, ImageEntry) for entry in self.entries)
        sentences = []
        if records.damaged_chunks:
            written = sum(n for c, n in self._counts.items() if _is_image(*self.topics[c]))
            sentences.append(
                f"{name} is damaged: {records.damaged_chunks} of its {records.chunks} chunks are "
                f"left out, with {written - read} of {written} images and all that happened there"
            )
        elif records.damaged_places and not records.finished:
            places = records.damaged_places
            sentences.append(
                f"{name} is damaged in {places} {'place' if places == 1 else 'places'}: the images "
                f"there are left out, with all that happened there; {read} are read"
            )
        for part in self.session.damaged:
            sentences.append(f"the {part} in {name} is damaged and left out")
        return "; ".join(sentences)


def later_reference(attachment: McapRecord) -> str | None:
    """Return the name of the reference in an attachment; None if it is another file."""
    name, _ = text_at(attachment.content, 16)
    found = name.removeprefix(REFERENCES).removesuffix(".npz")
    return found if name.startswith(REFERENCES) else None


def _is_image(schema: str, topic: str) -> bool:
    """Whether messages of a channel are what the camera sent, not maps that were measured."""
    return schema in (RAW_IMAGE, COMPRESSED_IMAGE) and topic.split("/")[3:4] == ["camera"]


def _json(record: McapRecord) -> Mapping[str, Any]:
    if record.place.length > (1 << 20):  # [bytes] of an event
        raise ValueError("an event is too large")
    values = json.loads(bytes(record.content[MESSAGE_HEADER.size :]))
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
