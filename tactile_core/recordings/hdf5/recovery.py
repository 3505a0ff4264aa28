"""Writes what is complete in an interrupted HDF5 recording to a new, ordinary file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from tactile_core.recordings.hdf5.columns import IMAGES, JSON, LEVELS, NUMBERS, READINGS, ROWS
from tactile_core.recordings.hdf5.file import Hdf5File
from tactile_core.recordings.hdf5.growing_file import END, GrowingFile
from tactile_core.recordings.hdf5.writer import (
    BEFORE,
    EVENTS,
    FINISHED,
    READINGS_THERE,
    REFERENCES,
    SESSION,
)
from tactile_core.recordings.recording_file import ImageEntry

_BLOCK_BYTES = 1 << 24
"""Rows that are copied at once, bytes."""


def copy_rows(path: Path, fresh: Path) -> int:
    """Copy all complete images, events and readings; return their number."""
    with Hdf5File(path) as file:
        with closing(GrowingFile(fresh)) as new:
            new.reserve([SESSION, REFERENCES, IMAGES, READINGS, ROWS], {})
            new.describe(file.format)
            for group in (SESSION, REFERENCES):
                for name in file.columns.inside(group):
                    new.put(group + name, file.columns.read(group + name).tobytes())
            for name, rows in _complete_rows(file):
                _copy_column(file, name, rows, new)
            new.append(FINISHED, np.array([True]))
        return len(file.entries) + file.readings


def _complete_rows(file: Hdf5File) -> Iterator[tuple[str, int]]:
    """Yield each column and the number of its rows that belong to something complete."""
    columns, readings = file.columns, file.readings
    places = [entry.place for entry in file.entries if isinstance(entry, ImageEntry)]
    images, events = len(places), len(file.entries) - len(places)
    encoded = [place.end for place in places if place.compressed]
    yield from _complete_bytes(file, IMAGES + "bytes", len(encoded))
    yield IMAGES + "pixels", images - len(encoded)
    yield IMAGES + "compressed", images
    for column in NUMBERS:
        yield IMAGES + column.name, images
    for name in columns.inside(LEVELS):
        yield LEVELS + name, images
    yield from _complete_bytes(file, EVENTS, events)
    yield BEFORE, events
    for name in JSON:
        yield from _complete_bytes(file, name, readings)
    for name in columns.inside(READINGS):
        if ROWS + name in columns:
            rows = int(np.searchsorted(columns.read(ROWS + name), readings))
            yield READINGS + name, rows
            yield ROWS + name, rows
    yield READINGS_THERE, columns.rows(READINGS_THERE)


def _complete_bytes(file: Hdf5File, name: str, count: int) -> Iterator[tuple[str, int]]:
    """Yield a column of bytes and that of its ends, each with its rows of so many entries."""
    if count:
        yield name, int(file.columns.read(name + END, count - 1, count)[0])
        yield name + END, count


def _copy_column(file: Hdf5File, name: str, rows: int, new: GrowingFile) -> None:
    columns = file.columns
    if name not in columns:
        return
    attributes, compressed = columns.attributes(name), columns.is_compressed(name)
    first = columns.read(name, 0, min(rows, 1))
    new.append(name, first, attributes=attributes, compressed=compressed)
    step = max(1, _BLOCK_BYTES // max(1, first.nbytes))
    for begin in range(1, rows, step):
        new.append(name, columns.read(name, begin, min(begin + step, rows)))
