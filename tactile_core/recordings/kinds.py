"""The formats of recordings that a sensor writes, by the ending of the path."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import is_file

if TYPE_CHECKING:
    from tactile_core.recordings.recorder import RecordingWriter
    from tactile_core.recordings.recording_file import RecordingFile


class _Kind(NamedTuple):
    """Writer and reader of a format, as ``module:name``."""

    writer: str
    file: str


_ROOM = "tactile_core.recordings"
_FOLDER = _Kind(f"{_ROOM}.folder.file:FolderWriter", f"{_ROOM}.folder.file:FolderFile")
_KINDS = MappingProxyType(
    {
        ".mcap": _Kind(f"{_ROOM}.mcap.writer:McapWriter", f"{_ROOM}.mcap.file:McapFile"),
        ".h5": _Kind(f"{_ROOM}.hdf5.file:Hdf5Writer", f"{_ROOM}.hdf5.file:Hdf5File"),
    }
)
_LIVE = ".mcap"

# Name of the list of images and events in a folder; it makes the folder a recording.
LIST = "recording.jsonl"


def is_recorded(path: Path) -> bool:
    """Whether the path is that of a recording that a sensor wrote, judging by its name."""
    return path.suffix.lower() in _KINDS or is_file(path / LIST)


def writes(path: Path) -> bool:
    """Whether :func:`copy_writer` has a writer for a path: by its ending, or without one."""
    return not path.suffix or path.suffix.lower() in _KINDS


def recording_writer(path: Path) -> RecordingWriter:
    """Return the writer of a live recording for a path: MCAP, or a folder if it has no ending.

    Raises
    ------
    InputError
        The path exists, or its ending is that of no format of live recordings.
    """
    if os.path.lexists(path):
        raise InputError(f"{path} already exists; name another file for the recording")
    if path.suffix.lower() in _KINDS and path.suffix.lower() != _LIVE:
        raise InputError(
            f"{path}: a {path.suffix} file is not recorded, but written afterwards by 'tactile "
            f"convert'; record {path.with_suffix(_LIVE).name} first"
        )
    if path.suffix and path.suffix.lower() != _LIVE:
        raise InputError(
            f"{path}: a recording ends in {_LIVE}, or is a folder, whose name has no ending"
        )
    if not path.parent.is_dir():
        raise InputError(f"{path.parent} is no folder; make it, or name another one")
    return copy_writer(path)


def copy_writer(path: Path) -> RecordingWriter:
    """Return the writer of a copy of a recording: MCAP, HDF5, or a folder."""
    kind = _KINDS.get(path.suffix.lower(), _FOLDER)
    writer: RecordingWriter = _load_attribute(kind.writer)(path)
    return writer


def recording_file(path: Path) -> RecordingFile:
    """Open a recording that a sensor wrote.

    Raises
    ------
    InputError
        It is damaged, or not of the format that its name says.
    """
    kind = _KINDS.get(path.suffix.lower(), _FOLDER)
    file: RecordingFile = _load_attribute(kind.file)(path)
    return file


def _load_attribute(name: str) -> Any:
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)
