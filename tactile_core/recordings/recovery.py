"""Writes what is complete in an interrupted recording to a new file for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from tactile_core.errors import InputError
from tactile_core.formats.unfinished import temporary_path
from tactile_core.recordings.kinds import copy_complete, is_recorded, recording_file
from tactile_core.recordings.recording_file import ImageEntry


class Recovered(NamedTuple):
    """What was recovered.

    Attributes
    ----------
    path : Path
    images : int
    messages : int
        Of MCAP: its messages. Of HDF5: images, events and readings.
    """

    path: Path
    images: int
    messages: int


def recover(path: Path, out: Path | None = None) -> Recovered:
    """Write everything that is complete in an interrupted recording to a new file.

    Parameters
    ----------
    path : Path
        An ``.mcap`` or ``.h5`` file, whose end may be missing; it stays as it is.
    out : Path, optional
        Default: next to it, as ``NAME.recovered.mcap`` or ``.h5``.

    Raises
    ------
    InputError
        The file is complete or without a complete image, is no such file, or ``out`` exists.
    OSError
        The disk is full or not writable; nothing is left behind.
    """
    out = path.with_suffix(f".recovered{path.suffix}") if out is None else out
    if out.exists() or out.is_symlink():
        raise InputError(f"{out} already exists; move it away or name another --out")
    if path.is_dir():
        raise InputError(f"{path} is a folder; every program reads the images in it as they are")
    if not is_recorded(path):
        raise InputError(f"{path} is no recording of tactile; give an .mcap or .h5 file")
    if out.suffix.lower() != path.suffix.lower():
        raise InputError(f"--out {out} is of another kind; end it in {path.suffix}")
    with recording_file(path) as file:
        if file.finished:
            raise InputError(f"{path} is complete; there is nothing to recover")
        images = sum(isinstance(entry, ImageEntry) for entry in file.entries)
    if not images:
        raise InputError(f"{path} has no complete image; record again")
    fresh = temporary_path(out)
    try:
        messages = copy_complete(path, fresh)
        fresh.rename(out)
    finally:
        fresh.unlink(missing_ok=True)
    return Recovered(out, images, messages)
