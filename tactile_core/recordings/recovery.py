"""Writes what is sound in an interrupted or damaged MCAP recording to a new file with an index."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.folders import rename_new
from tactile_core.formats.unfinished import temporary_path
from tactile_core.recordings.kinds import is_recorded
from tactile_core.recordings.mcap.file import McapFile, later_reference
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    DAMAGED,
    MESSAGE,
    MESSAGE_HEADER,
    Record,
)
from tactile_core.recordings.mcap.topics import IMAGE_INFO
from tactile_core.recordings.mcap.writer import McapWriter
from tactile_core.recordings.recording_file import RESUMED, ImageEntry

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
        count = sum(_copied(record, file, writer) for record in file.records)
    except BaseException:
        writer.abandon()
        raise
    writer.close()
    return count


def _copied(record: Record, file: McapFile, writer: McapWriter) -> bool:
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
