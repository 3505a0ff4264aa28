"""Writes a recording as HDF5, for analysis."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.interfaces.reading import Reading
from tactile_core.quantities import Reference
from tactile_core.recordings.hdf5.column_file import ColumnFile
from tactile_core.recordings.hdf5.columns import ImageColumns, ReadingColumns
from tactile_core.recordings.recorder import RecordedImage, RecordedSession, RecordingWriter
from tactile_core.recordings.session_files import reference_bytes, session_files

FORMAT, VERSION = "tactile recording", 1  # Attributes `format` and `version` of the file

# Groups of files: those of the session, and references by name.
SESSION, REFERENCES = "session/", "references/"

# Columns: each event as JSON, the number of images before it, and a row at the very end.
EVENTS, BEFORE, FINISHED = "events", "events_after_image", "finished"


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
