"""Reads a recording in HDF5, also one that is still growing or was interrupted."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.errors import InputError
from tactile_core.formats.images import decode_image
from tactile_core.formats.saved_quantities import DESCRIPTION
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.hdf5.columns import IMAGES, JSON, LEVELS, NONE, NUMBERS, READINGS, ROWS
from tactile_core.recordings.hdf5.growing_file import END, open_growing
from tactile_core.recordings.hdf5.readable_columns import INCOMPLETE, ReadableColumns
from tactile_core.recordings.hdf5.writer import (
    BEFORE,
    EVENTS,
    FINISHED,
    FORMAT,
    READINGS_THERE,
    REFERENCES,
    SESSION,
    VERSION,
)
from tactile_core.recordings.recorder import RecordedSession
from tactile_core.recordings.recording_file import (
    EventEntry,
    ImageEntry,
    RecordingFile,
    recorded_image,
)
from tactile_core.recordings.session_files import reference_from, session_of

if TYPE_CHECKING:
    import h5py

_INTEGERS = frozenset(column.name for column in NUMBERS if column.dtype == "i8")


class _Place(NamedTuple):
    """Rows of an image: from ``begin`` to ``end`` in the bytes, or one in the pixels."""

    compressed: bool
    begin: int
    end: int


class Hdf5File(RecordingFile):
    """One recording in HDF5.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        It is no such recording, of a newer version, or ``h5py`` is not installed.

    Attributes
    ----------
    columns : ReadableColumns
    format : dict of str to object
        Attributes of the file: format, version and sensor.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: h5py.File = open_growing(path)
        try:
            self.format = _checked_format(self._file, path)
            self.columns = ReadableColumns(self._file)
            self.session: RecordedSession = session_of(self._files(SESSION), path)
            self.entries = tuple(self._in_order())
        except BaseException:
            self._file.close()
            raise
        self.finished = self.columns.complete and self.columns.rows(FINISHED) > 0
        self._known_rows: dict[str, NDArray[np.int64]] = {}

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        place: _Place = entry.place
        name = f"image {entry.described['number']} of {self.path.name}"
        encoded: bytes | None = None
        try:
            if place.compressed:
                encoded = self.columns.read(IMAGES + "bytes", place.begin, place.end).tobytes()
                pixels = decode_image(encoded, name)
            else:
                (pixels,) = self.columns.read(IMAGES + "pixels", place.begin, place.end)
        except (OSError, ValueError) as error:
            raise InputError(f"{name} is damaged ({error}); copy the recording again") from error
        return recorded_image(pixels, entry, encoded)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def reference(self, name: str) -> Reference:
        """Read the reference of this name."""
        if REFERENCES + name not in self.columns:
            raise InputError(f"{self.path} has no reference {name!r}; give --reference")
        return reference_from(self.columns.read(REFERENCES + name).tobytes(), self.path)

    @property
    def readings(self) -> int:
        """Number of complete readings."""
        there = min(map(self._complete, JSON))
        if self.finished:
            return there
        if rows := self.columns.rows(READINGS_THERE):
            there = min(there, int(self.columns.read(READINGS_THERE, rows - 1, rows)[0]))
        return there if self.columns.complete else self._with_all_arrays(there)

    def _with_all_arrays(self, there: int) -> int:
        """Return how many readings from the first have lost no array and no row of one."""
        columns, names = self.columns, set[str]()
        for name in columns.inside(READINGS):
            if READINGS + name not in columns or ROWS + name not in columns:
                continue
            names.add(name)
            if columns.lacks(READINGS + name) or columns.lacks(ROWS + name):
                rows = min(columns.rows(READINGS + name), columns.rows(ROWS + name))
                # of the reading of the last row, further rows may be missing
                there = min(there, int(self._rows_of(name)[rows - 1]) if rows else 0)
        return next((n for n in range(there) if not self._wanted(n) <= names), there)

    def reading_line(self, number: int) -> dict[str, Any]:
        """Return the line of ``tactile run --json`` of a reading."""
        line: dict[str, Any] = json.loads(self._bytes("readings_json", number))
        return line

    def reading_arrays(self, number: int) -> dict[str, NDArray[Any]]:
        """Return the arrays of a reading, as in the ``.npz`` that ``tactile run`` writes.

        :func:`tactile_core.formats.saved_quantities.quantities_in` makes quantities of them.
        """
        names = {"valid", "mm_per_px"} | self._wanted(number)
        found = {name: a for name in names if (a := self._array(name, number)) is not None}
        found[DESCRIPTION] = np.frombuffer(self._bytes("quantities_json", number), np.uint8)
        return found

    def _wanted(self, number: int) -> set[str]:
        """Return the names of the arrays that make the quantities of a reading."""
        entries = json.loads(self._bytes("quantities_json", number)).values()
        return set[str]().union(*(entry["arrays"].values() for entry in entries))

    def _in_order(self) -> Iterator[ImageEntry | EventEntry]:
        images = list(self._images())
        passed = 0
        events = min(self._complete(EVENTS), self.columns.rows(BEFORE))
        before_image = self.columns.read(BEFORE) if events else ()
        for number in range(events):
            before = int(before_image[number])
            if before > len(images):
                break
            yield from images[passed:before]
            passed = before
            event = json.loads(self._bytes(EVENTS, number))
            yield EventEntry(event["name"], event["values"])
        yield from images[passed:]

    def _images(self) -> Iterator[ImageEntry]:
        columns = self.columns
        names = [IMAGES + "compressed", *(IMAGES + column.name for column in NUMBERS)]
        rows = min(map(columns.rows, names))
        if not rows:
            return
        compressed = columns.read(names[0])
        numbers = {column.name: columns.read(IMAGES + column.name) for column in NUMBERS}
        levels = {name: columns.read(LEVELS + name) for name in columns.inside(LEVELS)}
        rows = min([rows, *map(len, levels.values())])
        available = columns.rows(IMAGES + "bytes")
        ends = columns.read(IMAGES + "bytes" + END) if available else np.zeros(0, np.int64)
        pixels = columns.rows(IMAGES + "pixels")
        of_bytes = of_pixels = 0
        for row in range(rows):
            if compressed[row]:
                if of_bytes >= len(ends) or ends[of_bytes] > available:
                    return
                begin = int(ends[of_bytes - 1]) if of_bytes else 0
                place = _Place(True, begin, int(ends[of_bytes]))
                of_bytes += 1
            else:
                if of_pixels >= pixels:
                    return
                place = _Place(False, of_pixels, of_pixels + 1)
                of_pixels += 1
            yield ImageEntry(_described(row, numbers, levels), place)

    def _files(self, group: str) -> dict[str, bytes]:
        """Return the content of the files in a group, by name."""
        try:
            return {
                name: self.columns.read(group + name).tobytes()
                for name in self.columns.inside(group)
            }
        except OSError as error:
            raise InputError(
                f"{self.path} ends before its first image; copy or record it again"
            ) from error

    def _complete(self, name: str) -> int:
        """Return the number of complete rows of a column of bytes."""
        ends = self.columns.read(name + END) if self.columns.rows(name) else np.zeros(0, np.int64)
        return int(np.searchsorted(ends, self.columns.rows(name), side="right"))

    def _bytes(self, name: str, row: int) -> bytes:
        first = max(row - 1, 0)
        *before, end = self.columns.read(name + END, first, row + 1)
        begin = int(before[0]) if before else 0
        return self.columns.read(name, begin, int(end)).tobytes()

    def _array(self, name: str, number: int) -> NDArray[Any] | None:
        """Return an array of a reading; None if it has none of this name."""
        column, next_kind = name, 1
        empty: NDArray[Any] | None = None
        while ROWS + column in self.columns:
            begin, end = np.searchsorted(self._rows_of(column), [number, number + 1])
            many = self.columns.attributes(READINGS + column).get("rows") == "many"
            values = _restored(self.columns.read(READINGS + column, int(begin), int(end)))
            if end > begin:
                return values if many else np.asarray(values[0])
            if many and empty is None:
                empty = values
            next_kind += 1
            column = f"{name}.{next_kind}"
        return empty

    def _rows_of(self, column: str) -> NDArray[np.int64]:
        """Return the number of the reading of each row of a column."""
        if column not in self._known_rows:
            self._known_rows[column] = self.columns.read(ROWS + column)
        return self._known_rows[column]


def _checked_format(file: h5py.File, path: Path) -> dict[str, Any]:
    """Return the attributes of a file that is a recording."""
    try:
        attributes = dict(file.attrs)
    except (OSError, EOFError, KeyError, RuntimeError):
        attributes = {}
    if not attributes and file.driver == INCOMPLETE:
        raise InputError(f"{path} ends before its first image; copy or record it again")
    if attributes.get("format") != FORMAT:
        raise InputError(
            f"{path} is an HDF5 file, but no recording that tactile wrote; give a recording"
        )
    if attributes["version"] != VERSION:
        raise InputError(f"{path} was written by a newer tactile-core; update it to read this")
    return attributes


def _described(
    row: int, numbers: Mapping[str, NDArray[Any]], levels: Mapping[str, NDArray[Any]]
) -> dict[str, Any]:
    """Return what was written with an image, as :meth:`RecordedImage.described` gave it."""
    described: dict[str, Any] = {}
    for name, column in numbers.items():
        value = column[row].item()
        missing = value == NONE if name in _INTEGERS else value != value
        described[name] = None if missing else value
    found = {name: float(column[row]) for name, column in levels.items()}
    described["levels"] = {name: level for name, level in found.items() if level == level}
    return described


def _restored(values: NDArray[Any]) -> NDArray[Any]:
    return np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values
