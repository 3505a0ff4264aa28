"""Recordings in HDF5: read, and written by conversion."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.files import regular
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
from tactile_core.recordings.session_files import (
    reference_bytes,
    reference_from,
    session_files,
    session_of,
)
from tactile_hdf5.column_file import END, ColumnFile
from tactile_hdf5.columns import (
    IMAGES,
    LEVELS,
    NONE,
    NUMBERS,
    ImageColumns,
    ReadingColumns,
)

FORMAT, VERSION = "tactile recording", 1  # Attributes `format` and `version` of the file

# Groups of files: those of the session, and references by name.
SESSION, REFERENCES = "session/", "references/"

# Columns: each event as JSON, the number of images before it, and a row at the very end.
EVENTS, BEFORE, FINISHED = "events", "events_after_image", "finished"


class Hdf5(RecordingFormat):
    """Files that end in ``.h5``."""

    def write(self, path: Path) -> RecordingWriter:
        """Return the writer of a recording."""
        return Hdf5Writer(path)

    def read(self, path: Path) -> RecordingFile:
        """Open a finished recording."""
        return Hdf5File(path)


class Hdf5Writer(RecordingWriter):
    """Writes ``.h5``: a column for everything, with units and axes as attributes.

    What is not closed cannot be read.

    Parameters
    ----------
    path : Path
        Does not exist yet.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._file: ColumnFile | None = None

    def open(self, session: RecordedSession) -> None:
        """Create the file and write the session."""
        file = self._file = ColumnFile(self.path)
        try:
            file.describe({"format": FORMAT, "version": VERSION, "sensor": session.sensor})
            for name, content in session_files(session).items():
                file.put(SESSION + name, content)
        except BaseException:
            self._file = None
            with suppress(OSError):
                file.close()
            raise
        self._images, self._readings = ImageColumns(file), ReadingColumns(file)
        self._image_count = 0

    def write_image(self, recorded: RecordedImage) -> None:
        """Write an image, losslessly; one that came compressed as the same bytes."""
        self._images.write(recorded)
        self._image_count += 1

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        """Write an event."""
        line = json.dumps({"name": name, "values": dict(values)})
        self._opened.append_bytes(EVENTS, line.encode())
        self._opened.append(BEFORE, np.array([self._image_count], np.int64))

    def write_reference(self, name: str, reference: Reference) -> None:
        """Write a reference under a name."""
        self._opened.put(REFERENCES + name, reference_bytes(reference))

    def write_reading(self, reading: Reading) -> None:
        """Write the quantities of a reading and the line of ``tactile run --json``."""
        self._readings.write(reading)

    def check(self) -> None:
        """Do nothing: a copy is written where nobody looks."""

    def close(self) -> None:
        """Complete the file and close it."""
        if self._file is not None:
            file, self._file = self._file, None
            try:
                file.append(FINISHED, np.array([True]))
            finally:
                file.close()

    @property
    def _opened(self) -> ColumnFile:
        assert self._file is not None
        return self._file


# What h5py raises where a file is damaged.
_UNREADABLE = (OSError, RuntimeError, ValueError, LookupError)

_INTEGERS = frozenset(column.name for column in NUMBERS if column.dtype == "i8")


class _Place(NamedTuple):
    """Rows of an image: from ``begin`` to ``end`` in the bytes, or one in the pixels."""

    compressed: bool
    begin: int
    end: int


class Hdf5File(RecordingFile):
    """One finished recording in HDF5.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        It is no such recording, unfinished, or of a newer version.
    """

    finished = True

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: h5py.File = _open_file(path)
        try:
            _check_format(self._file, path)
            self.session: RecordedSession = session_of(self._files(SESSION), path)
            self.entries = tuple(self._in_order())
        except _UNREADABLE as error:
            self._file.close()
            raise InputError(f"{path} is damaged ({error}); copy or convert it again") from error
        except BaseException:
            self._file.close()
            raise

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        place: _Place = entry.place
        name = f"image {entry.described['number']} of {self.path.name}"
        encoded: bytes | None = None
        try:
            if place.compressed:
                encoded = self._read(IMAGES + "bytes", place.begin, place.end).tobytes()
                pixels = decode_image(encoded, name)
            else:
                (pixels,) = self._read(IMAGES + "pixels", place.begin, place.end)
        except _UNREADABLE as error:
            raise InputError(f"{name} is damaged ({error}); copy or convert it again") from error
        return recorded_image(pixels, entry, encoded)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def reference(self, name: str) -> Reference:
        """Read the reference of this name."""
        if REFERENCES + name not in self._file:
            raise InputError(f"{self.path} has no reference {name!r}; give --reference")
        return reference_from(self._read(REFERENCES + name).tobytes(), self.path)

    def _in_order(self) -> Iterator[ImageEntry | EventEntry]:
        images = list(self._images())
        passed = 0
        for number, before in enumerate(self._read(BEFORE).tolist()):
            yield from images[passed:before]
            passed = before
            event = json.loads(self._bytes(EVENTS, number))
            yield EventEntry(event["name"], event["values"])
        yield from images[passed:]

    def _images(self) -> Iterator[ImageEntry]:
        numbers = {column.name: self._read(IMAGES + column.name) for column in NUMBERS}
        levels = {name: self._read(LEVELS + name) for name in self._file.get(LEVELS, ())}
        ends = self._read(IMAGES + "bytes" + END).tolist()
        of_bytes = of_pixels = 0
        for row, compressed in enumerate(self._read(IMAGES + "compressed").tolist()):
            if compressed:
                place = _Place(True, ends[of_bytes - 1] if of_bytes else 0, ends[of_bytes])
                of_bytes += 1
            else:
                place = _Place(False, of_pixels, of_pixels + 1)
                of_pixels += 1
            yield ImageEntry(_describe_row(row, numbers, levels), place)

    def _files(self, group: str) -> dict[str, bytes]:
        """Return the content of the files in a group, by name."""
        found: dict[str, bytes] = {}

        def take(name: str, item: Any) -> None:
            if hasattr(item, "shape"):
                found[name] = item[:].tobytes()

        self._file[group].visititems(take)
        return found

    def _read(self, name: str, begin: int = 0, end: int | None = None) -> NDArray[Any]:
        """Read rows of a column; one that was never written has none."""
        if name not in self._file:
            return np.zeros(0, np.int64)
        values: NDArray[Any] = self._file[name][begin:end]
        return values

    def _bytes(self, name: str, row: int) -> bytes:
        *before, end = self._read(name + END, max(row - 1, 0), row + 1).tolist()
        return self._read(name, before[0] if before else 0, end).tobytes()


def _open_file(path: Path) -> h5py.File:
    try:
        return h5py.File(regular(path), "r", locking=False)
    except OSError as error:
        raise InputError(
            f"{path} is not a readable HDF5 file ({error}); copy or convert it again"
        ) from None


def _check_format(file: h5py.File, path: Path) -> None:
    """Refuse a file that is no finished recording."""
    attributes = dict(file.attrs)
    if attributes.get("format") != FORMAT:
        raise InputError(
            f"{path} is an HDF5 file, but no recording that tactile wrote; save its images as PNG"
        )
    if attributes["version"] != VERSION:
        raise InputError(f"{path} was written by a newer tactile-hdf5; update it to read this")
    if FINISHED not in file or not len(file[FINISHED]):
        raise InputError(f"{path} was never finished; convert its recording again")


def _describe_row(
    row: int, numbers: Mapping[str, NDArray[Any]], levels: Mapping[str, NDArray[Any]]
) -> dict[str, Any]:
    """Return what was written with an image, as :meth:`RecordedImage.describe_image` gave it."""
    described: dict[str, Any] = {}
    for name, column in numbers.items():
        value = column[row].item()
        missing = value == NONE if name in _INTEGERS else value != value
        described[name] = None if missing else value
    found = {name: float(column[row]) for name, column in levels.items()}
    described["levels"] = {name: level for name, level in found.items() if level == level}
    return described
