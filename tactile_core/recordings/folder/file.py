"""A folder of images as a recording: read and written."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes
from tactile_core.formats.headers import kind_of
from tactile_core.formats.images import decode_image
from tactile_core.interfaces.recording_format import (
    EventEntry,
    ImageEntry,
    RecordingFile,
    RecordingFormat,
    recorded_image,
)
from tactile_core.interfaces.recording_writer import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.interfaces.sink import Reading
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.appended_file import AppendedFile
from tactile_core.recordings.session_files import (
    LIST,
    reference_bytes,
    reference_from,
    session_files,
    session_of,
)

# Names in the folder.
SESSION_FOLDER, REFERENCES_FOLDER, READINGS = "session", "session/references", "readings.jsonl"

FINISHED = "finished"  # Event at the end of a list that was closed

# A higher compression takes several times as long for a few per cent.
_FAST = (int(cv2.IMWRITE_PNG_COMPRESSION), 1)


class FolderWriter(RecordingWriter):
    """Writes each image to a file of its own, and all that belongs to it to a list.

    Images that came compressed are stored as they came, others as PNG. A list of JSON objects, one
    a line, has the images and the events in order.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._list: AppendedFile | None = None
        self._readings: AppendedFile | None = None
        self._failed = False

    def open(self, session: RecordedSession) -> None:
        """Create the folder and write the session."""
        self.path.mkdir()
        for name, content in session_files(session).items():
            file = self.path / SESSION_FOLDER / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        (self.path / REFERENCES_FOLDER).mkdir(parents=True)
        self._sequential = session.exposures > 1
        self._list = AppendedFile(self.path / LIST)

    def write_image(self, recorded: RecordedImage) -> None:
        """Write an image, then its line of the list."""
        content = recorded.image.encoded
        if content is None:
            assert isinstance(recorded.image, Image)
            content = _png(recorded.image.pixels)
        ending = {"jpeg": "jpg", "tiff": "tif"}.get(kind := kind_of(content) or "bin", kind)
        name = f"{recorded.number:06d}.{ending}"
        if self._sequential:
            folder = f"{recorded.observation or 0:06d}"
            name = f"{folder}/{recorded.exposure_index:02d}.{ending}"
        self._write(name, content)
        self._add({"image": recorded.describe_image(), "file": name})

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Write the event's line of the list."""
        self._add({"event": name, "values": values})

    def write_reference(self, name: str, reference: Reference) -> None:
        """Write a reference to a file of its own."""
        self._write(f"{REFERENCES_FOLDER}/{name}.npz", reference_bytes(reference))

    def write_reading(self, reading: Reading) -> None:
        """Write the line of ``tactile run --json``; a folder holds no maps."""
        if self._readings is None:
            self._readings = AppendedFile(self.path / READINGS)
        self._readings.write(_line(reading.summary()))

    def check(self) -> None:
        """Check that the folder is still there."""
        assert self._list is not None
        self._list.check()

    def close(self) -> None:
        """Note that the list is complete, and close it."""
        if self._list is not None:
            try:
                if not self._failed:
                    self._list.check()
                    self._add({"event": FINISHED, "values": {}})
            finally:
                self._list.close()
                self._list = None
        if self._readings is not None:
            self._readings.close()

    def _write(self, name: str, content: bytes) -> None:
        """Write a file, and count what follows an error as not recorded."""
        try:
            if "/" in name:
                (self.path / name).parent.mkdir(exist_ok=True)
            (self.path / name).write_bytes(content)
        except BaseException:
            self._failed = True
            raise

    def _add(self, entry: Mapping[str, Any]) -> None:
        assert self._list is not None
        try:
            self._list.write(_line(entry))
        except BaseException:
            self._failed = True
            raise


def _line(values: Mapping[str, Any]) -> bytes:
    return json.dumps(values).encode() + b"\n"


def _png(pixels: np.ndarray[Any, Any]) -> bytes:
    ordered = pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., ::-1])
    return bytes(cv2.imencode(".png", ordered, _FAST)[1])


# Names of images, which are never outside the folder.
_NAME = re.compile(r"(?:\d{6,}/)?\d{2,}\.[a-z]{3,4}", re.ASCII)

_PIXELS = ".png"  # Ending of images that came as pixels; others have the bytes that the camera sent

_REFERENCE = re.compile(r"\d{4,}", re.ASCII)


class FolderFile(RecordingFile):
    """A recording in a folder.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        The list or the session is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = False
        place = path / SESSION_FOLDER
        files = {
            file.relative_to(place).as_posix(): read_bytes(file)
            for file in sorted(place.rglob("*"))
            if file.is_file() and file.parent != path / REFERENCES_FOLDER
        }
        self.session = session_of(files, path)
        self.entries = tuple(self._find_entries(read_bytes(path / LIST)))

    def close(self) -> None:
        """Do nothing: no file is open."""

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        file = self.path / str(entry.place)
        data = read_bytes(file)
        encoded = None if file.suffix == _PIXELS else data
        return recorded_image(decode_image(data, str(file)), entry, encoded)

    def reference(self, name: str) -> Reference:
        """Read the reference of this name."""
        if not _REFERENCE.fullmatch(name):
            raise InputError(f"{self.path / LIST} is damaged; copy the recording again")
        return reference_from(read_bytes(self.path / REFERENCES_FOLDER / f"{name}.npz"), self.path)

    def _find_entries(self, data: bytes) -> Iterator[ImageEntry | EventEntry]:
        *lines, _ = data.split(b"\n")  # a line without its end is incomplete
        for number, line in enumerate(lines, 1):
            try:
                values = json.loads(line)
                if "image" in values:
                    if not _NAME.fullmatch(values["file"]):
                        raise ValueError(values["file"])
                    yield ImageEntry(values["image"], values["file"])
                elif values["event"] == FINISHED:
                    self.finished = True
                else:
                    yield EventEntry(_text(values["event"]), values["values"])
            except (ValueError, LookupError, TypeError, RecursionError) as error:
                raise InputError(
                    f"{self.path / LIST}:{number} is damaged; copy the recording again"
                ) from error


class FolderFormat(RecordingFormat):
    """Folders of images."""

    def write(self, path: Path) -> FolderWriter:
        """Return the writer of a folder."""
        return FolderWriter(path)

    def read(self, path: Path) -> FolderFile:
        """Open a folder."""
        return FolderFile(path)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(value)
    return value
