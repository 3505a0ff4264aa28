"""Saves one reading as files, as ``tactile run --save`` does."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Lock

from tactile_core.errors import InputError
from tactile_core.interfaces.reading import Reading
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sinks import Sinks
from tactile_core.recordings.output_folder import OutputFolder

SAVED = ("npz", "png")  # What a snapshot saves by default

_GIVEN: set[Path] = set()
_GIVING = Lock()


def new_path(out: Path, name: str, ending: str = "") -> Path:
    """Return a new path in the folder, never twice the same: time, name of the sensor, ending."""
    stem = f"{time.strftime('%Y-%m-%d_%H%M%S')}_{re.sub(r'[^A-Za-z0-9._-]', '_', name)}"
    path = out / f"{stem}{ending}"
    number = 1
    with _GIVING:
        while path.exists() or path in _GIVEN:
            number += 1
            path = out / f"{stem}_{number}{ending}"
        _GIVEN.add(path)
    return path


def save_snapshot(
    pipeline: Pipeline, reading: Reading, out: Path, name: str, sinks: Sequence[str] = SAVED
) -> Path:
    """Write the files of a reading to a new folder, and return the folder.

    Raises
    ------
    InputError
        A sink is unknown, or nothing was written.
    OSError
        The disk is full or not writable.
    """
    folder = OutputFolder(new_path(out, name))
    with Sinks(pipeline.profile, sinks).open(pipeline, folder) as opened:
        opened.write(reading)
    if not folder.path.is_dir():
        raise InputError("nothing of this reading can be saved; take a reference first")
    return folder.path
