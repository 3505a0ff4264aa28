"""Recordings of a folder, and what can be saved of unfinished ones."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.files import temporary_path
from tactile_core.formats.folders import rename_new
from tactile_core.formats.scan import SCAN_FILE
from tactile_core.formats.text import printable
from tactile_core.formats.video import VIDEO_SUFFIXES
from tactile_core.interfaces.recording_format import RESUMED, ImageEntry
from tactile_core.recordings.mcap.file import McapFile, later_reference
from tactile_core.recordings.mcap.quantities import IMAGE_INFO
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    DAMAGED,
    MESSAGE,
    MESSAGE_HEADER,
    McapRecord,
)
from tactile_core.recordings.mcap.writer import McapWriter
from tactile_core.recordings.output_folder import safe_stem
from tactile_core.recordings.recording import is_one_recording
from tactile_core.recordings.session_files import sorted_by_name
from tactile_core.recordings.source import is_recorded

_ENDING = ".mcap"


class Recovered(NamedTuple):
    """What was recovered.

    Attributes
    ----------
    path : Path
    images, messages : int
    damage : str
        Says how much was damaged and left out; empty if nothing was.
    """

    path: Path
    images: int
    messages: int
    damage: str


def recover(path: Path, out: Path | None = None) -> Recovered:
    """Write everything that is sound in an interrupted or damaged recording to a new file.

    Parameters
    ----------
    path : Path
        An ``.mcap`` file; it stays as it is.
    out : Path, optional
        Default: next to it, as ``NAME.recovered.mcap``.

    Raises
    ------
    InputError
        The file is complete or without a sound image, is no such file, or ``out`` exists.
    OSError
        The disk is full or not writable; nothing is left behind.
    """
    out = path.with_suffix(f".recovered{path.suffix}") if out is None else out
    if os.path.lexists(out):
        raise InputError(f"{out} already exists; move it away or name another --out")
    if path.suffix.lower() != _ENDING:
        raise InputError(f"{path} is no {_ENDING} file; only these are recovered{_instead(path)}")
    if out.suffix.lower() != _ENDING:
        raise InputError(f"--out {out} is of another kind; end it in {_ENDING}")
    with McapFile(path) as file:
        if file.finished and not file.damaged_places:
            raise InputError(f"{path} is complete; there is nothing to recover")
        images = sum(isinstance(entry, ImageEntry) for entry in file.entries)
        if not images:
            raise InputError(f"{path} has no complete image; record again")
        fresh = temporary_path(out)
        try:
            messages = _copy(file, fresh)
            rename_new(fresh, out)
        finally:
            fresh.unlink(missing_ok=True)
        return Recovered(out, images, messages, file.damage)


def _instead(path: Path) -> str:
    if is_recorded(path):
        return ", and every command reads the images in it as they are"
    return "; give a recording of 'tactile record'"


def _copy(file: McapFile, fresh: Path) -> int:
    """Copy every sound message and reference; return the number of messages."""
    writer = McapWriter(fresh)
    writer.open(file.session)
    try:
        count = sum(_copy_record(record, file, writer) for record in file.records)
    except BaseException:
        writer.abandon()
        raise
    writer.close()
    return count


def _copy_record(record: McapRecord, file: McapFile, writer: McapWriter) -> bool:
    """Copy a record; return whether it is a message."""
    if record.kind == DAMAGED:
        writer.write_event(RESUMED, {})
    elif record.kind == ATTACHMENT and (name := later_reference(record)) is not None:
        writer.write_reference(name, file.reference(name))
    if record.kind != MESSAGE:
        return False
    channel, number, time_ns, _ = MESSAGE_HEADER.unpack_from(record.content)
    if channel not in file.topics:
        return False
    schema, topic = file.topics[channel]
    data = bytes(record.content[MESSAGE_HEADER.size :])
    writer.add("/".join(topic.split("/")[3:]), schema, time_ns, data, number)
    if schema != IMAGE_INFO:  # its image follows in the same chunk
        writer.complete_chunk()
    return True


@dataclass(frozen=True)
class NamedRecording:
    """A recording, not yet opened.

    Attributes
    ----------
    name : str
        Name of the file without its ending, or of the folder; names the folder of its results.
    path : Path
    """

    name: str
    path: Path


def list_recordings(
    paths: Sequence[Path], *, images_per_observation: int = 1
) -> tuple[NamedRecording, ...]:
    """Return the recordings at these paths, in natural order of the names in each folder.

    A path that :func:`~tactile_core.recordings.recording.open_recording` takes for one recording is
    that recording. Any other folder is a folder of recordings: of the videos, of the files that a
    sensor recorded, and of the folders, in it that are one recording each. Other files in it are
    ignored.

    Parameters
    ----------
    paths : sequence of Path
    images_per_observation : int
        Exposures per frame: 1, or the number of sequential lights.

    Raises
    ------
    InputError
        A path does not exist, a folder contains no recording, or two recordings have the same
        name.
    """
    found = [one for path in paths for one in _recordings_at(path, images_per_observation)]
    names: dict[str, Path] = {}
    for path in found:
        other = names.setdefault(_name_of(path), path)
        if other != path:
            raise InputError(
                f"the results of {other} and of {path} would both be in the folder "
                f"{printable(_name_of(path))}; rename one of them, or measure them into separate "
                f"--out folders"
            )
    return tuple(NamedRecording(name, path) for name, path in names.items())


def is_folder_of_recordings(path: Path, *, images_per_observation: int = 1) -> bool:
    """Whether a path is a folder that is not one recording itself, but contains recordings.

    Raises
    ------
    InputError
        The path does not exist, or the folder may not be read.
    """
    return not is_one_recording(path, images_per_observation=images_per_observation) and bool(
        _inside(path, images_per_observation)
    )


def unread_recordings(folder: Path) -> list[Path]:
    """Return the videos and other recordings in a folder of images, which is read without them."""
    return [] if not folder.is_dir() else [path for path in folder.iterdir() if _is_file(path)]


def _recordings_at(path: Path, count: int) -> list[Path]:
    if is_one_recording(path, images_per_observation=count):
        return [path]
    found = _inside(path, count)
    if not found:
        raise InputError(
            f"{path} contains no recording: no image, scan or video, and no folder of images"
        )
    return found


def _inside(folder: Path, count: int) -> list[Path]:
    entries = sorted_by_name(folder.iterdir(), lambda path: path.name)
    return [path for path in entries if _is_file(path) or _is_folder(path, count)]


def _is_file(path: Path) -> bool:
    shown = not path.name.startswith(".") and path.is_file()
    return shown and (path.suffix.lower() in VIDEO_SUFFIXES or is_recorded(path))


def _is_folder(path: Path, count: int) -> bool:
    shown = not path.name.startswith(".")
    return shown and path.is_dir() and is_one_recording(path, images_per_observation=count)


def _name_of(path: Path) -> str:
    if path.name == SCAN_FILE:
        path = path.parent
    name = path.absolute().name
    if name in ("", ".."):  # a link's own name is kept, but '..' names nothing
        name = path.resolve().name
    return safe_stem(name if path.is_dir() else Path(name).stem)
