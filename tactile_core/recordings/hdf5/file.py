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
from tactile_core.recordings.hdf5.columns import IMAGES, NONE, NUMBERS, READINGS, ROWS
from tactile_core.recordings.hdf5.growing_file import END, open_growing
from tactile_core.recordings.hdf5.writer import (
    BEFORE,
    EVENTS,
    FINISHED,
    FORMAT,
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
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: h5py.File = open_growing(path)
        if self._file.attrs.get("format") != FORMAT:
            raise InputError(
                f"{path} is an HDF5 file, but no recording that tactile wrote; give a recording"
            )
        if self._file.attrs["version"] != VERSION:
            raise InputError(f"{path} was written by a newer tactile-core; update it to read this")
        self.session: RecordedSession = session_of(self._files(SESSION), path)
        self.entries = tuple(self._in_order())
        self.finished = FINISHED in self._file
        self._known_rows: dict[str, NDArray[np.int64]] = {}

    def image(self, entry: ImageEntry) -> Image:
        """Read an image."""
        place: _Place = entry.place
        name = f"image {entry.described['number']} of {self.path.name}"
        encoded: bytes | None = None
        try:
            if place.compressed:
                encoded = self._file[IMAGES + "bytes"][place.begin : place.end].tobytes()
                pixels = decode_image(encoded, name)
            else:
                pixels = self._file[IMAGES + "pixels"][place.begin]
        except (OSError, KeyError, ValueError) as error:
            raise InputError(f"{name} is damaged ({error}); copy the recording again") from error
        return recorded_image(pixels, entry, encoded)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def reference(self, name: str) -> Reference:
        """Read the reference of this name."""
        found = self._file.get(REFERENCES + name)
        if found is None:
            raise InputError(f"{self.path} has no reference {name!r}; give --reference")
        return reference_from(found[:].tobytes(), self.path)

    @property
    def readings(self) -> int:
        """Number of complete readings."""
        return self._complete("readings_json" + END, "quantities_json" + END)

    def reading_line(self, number: int) -> dict[str, Any]:
        """Return the line of ``tactile run --json`` of a reading."""
        line: dict[str, Any] = json.loads(self._bytes("readings_json", number))
        return line

    def reading_arrays(self, number: int) -> dict[str, NDArray[Any]]:
        """Return the arrays of a reading, as in the ``.npz`` that ``tactile run`` writes.

        :func:`tactile_core.formats.saved_quantities.quantities_in` makes quantities of them.
        """
        description = self._bytes("quantities_json", number)
        entries = json.loads(description).values()
        wanted = {"valid", "mm_per_px"}.union(*(entry["arrays"].values() for entry in entries))
        found = {name: a for name in wanted if (a := self._array(name, number)) is not None}
        found[DESCRIPTION] = np.frombuffer(description, np.uint8)
        return found

    def _in_order(self) -> Iterator[ImageEntry | EventEntry]:
        images = list(self._images())
        passed = 0
        for number in range(self._complete(EVENTS + END, BEFORE)):
            before = int(self._file[BEFORE][number])
            if before > len(images):
                break
            yield from images[passed:before]
            passed = before
            event = json.loads(self._bytes(EVENTS, number))
            yield EventEntry(event["name"], event["values"])
        yield from images[passed:]

    def _images(self) -> Iterator[ImageEntry]:
        group = self._file.get(IMAGES)
        if group is None or "compressed" not in group:
            return
        compressed = group["compressed"][:]
        numbers = {column.name: group[column.name][:] for column in NUMBERS if column.name in group}
        if len(numbers) < len(NUMBERS):
            return
        lights = group.get("levels", {})
        levels = {name: column[:] for name, column in lights.items()}
        ends = group["bytes" + END][:] if "bytes" in group else np.zeros(0, np.int64)
        available = len(group["bytes"]) if "bytes" in group else 0
        pixels = len(group["pixels"]) if "pixels" in group else 0
        columns = [compressed, *numbers.values(), *levels.values()]
        of_bytes = of_pixels = 0
        for row in range(min(map(len, columns))):
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
        found: dict[str, bytes] = {}
        for name in self._file.get(group, ()):
            inside = self._file[group + name]
            if hasattr(inside, "shape"):
                found[name] = inside[:].tobytes()
            else:
                deeper = self._files(f"{group}{name}/")
                found.update({f"{name}/{rest}": content for rest, content in deeper.items()})
        return found

    def _complete(self, *columns: str) -> int:
        """Return the number of rows that all columns have."""
        return min(len(self._file[name]) if name in self._file else 0 for name in columns)

    def _bytes(self, name: str, row: int) -> bytes:
        ends = self._file[name + END]
        begin = int(ends[row - 1]) if row else 0
        content: bytes = self._file[name][begin : int(ends[row])].tobytes()
        return content

    def _array(self, name: str, number: int) -> NDArray[Any] | None:
        """Return an array of a reading; None if it has none of this name."""
        column, next_kind = name, 1
        empty: NDArray[Any] | None = None
        while ROWS + column in self._file:
            begin, end = np.searchsorted(self._rows_of(column), [number, number + 1])
            dataset = self._file[READINGS + column]
            many = dataset.attrs.get("rows") == "many"
            values = _restored(dataset[begin:end])
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
            self._known_rows[column] = self._file[ROWS + column][:]
        return self._known_rows[column]


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
