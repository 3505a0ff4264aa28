"""``core.record``: a recording of the sensor while it measures."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from pydantic import BaseModel, Field

from tactile_core.errors import InputError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.reading import Reading
from tactile_core.interfaces.sink import OpenRecording, Session, Sink

NAME = "recording.mcap"  # Name of the recording in the folder for results


class RecordOptions(Options):
    """Options of ``core.record``."""

    path: Path | None = Field(
        default=None,
        description="A new .mcap file, or a new folder. Default: recording.mcap in --out.",
    )
    readings: bool = Field(default=False, description="Whether the quantities are recorded, too.")


class Record(Sink):
    """What the camera sends, exactly, from the first reading to the last."""

    Options: ClassVar[type[BaseModel]] = RecordOptions

    def __init__(self, options: RecordOptions) -> None:
        super().__init__(options)
        self._settings = options
        self._recording: OpenRecording | None = None

    def open(self, session: Session) -> None:
        """Start the recording."""
        super().open(session)
        path = self._settings.path
        if session.record is None:
            raise InputError("this sink needs a sensor, but these readings come from none")
        if path is None:
            if session.folder is None:
                raise InputError("this sink writes a file; name a folder for it with --out")
            path = session.folder.path / NAME
            path.parent.mkdir(parents=True, exist_ok=True)
        self._recording = session.record(path, self._settings.readings)

    def write(self, reading: Reading) -> None:
        """Do nothing: the sensor records."""

    def close(self) -> None:
        """Complete the recording.

        Raises
        ------
        OSError
            It ended early.
        """
        if self._recording is not None:
            self._recording.close()
            if self._recording.failure is not None:
                raise OSError(self._recording.failure)
