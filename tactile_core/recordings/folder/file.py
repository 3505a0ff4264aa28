"""Reads recordings in folders of image files."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import read_bytes
from tactile_core.formats.images import decode_image
from tactile_core.quantities import Image, Reference
from tactile_core.recordings.folder.writer import FINISHED, REFERENCES_FOLDER, SESSION_FOLDER
from tactile_core.recordings.kinds import LIST
from tactile_core.recordings.recording_file import (
    EventEntry,
    ImageEntry,
    RecordingFile,
    recorded_image,
)
from tactile_core.recordings.session_files import reference_from, session_of

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
        self.entries = tuple(self._found(read_bytes(path / LIST)))

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

    def _found(self, data: bytes) -> Iterator[ImageEntry | EventEntry]:
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


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(value)
    return value
