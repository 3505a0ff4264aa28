"""Recording formats that each do one thing wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from tactile_core.interfaces.recording_format import RecordingFile, RecordingFormat
from tactile_core.interfaces.recording_writer import RecordingWriter
from tactile_core.recordings.folder.file import FolderFile, FolderWriter


class Folders(RecordingFormat):
    """Does nothing wrong: the folder of images of the core."""

    def write(self, path: Path) -> RecordingWriter:
        return FolderWriter(path)

    def read(self, path: Path) -> RecordingFile:
        return FolderFile(path)


class ForgetfulWriter(FolderWriter):
    """Leaves the events out."""

    def write_event(self, name: str, values: Mapping[str, Any]) -> None:
        pass


class Forgetful(Folders):
    """Loses the events."""

    def write(self, path: Path) -> RecordingWriter:
        return ForgetfulWriter(path)


class Unclosed(Folders):
    """Never closes its log."""

    logs: ClassVar[list[Any]] = []

    def read(self, path: Path) -> RecordingFile:
        self.logs.append(Path(__file__).open(encoding="utf-8"))  # noqa: SIM115
        return super().read(path)
