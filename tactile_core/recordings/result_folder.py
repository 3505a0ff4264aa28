"""A folder that holds the results of one recording, all of them or none."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text
from tactile_core.formats.folders import fresh_folder, replace_folder
from tactile_core.formats.json import plain
from tactile_core.recordings.output_folder import WRITTEN, OutputFolder

# Name of the file that is written last: what was measured, and with what.
MEASURED = "measured.json"

# Name of the file with one JSON object per reading, as `tactile run --json` prints them.
READINGS = "readings.jsonl"

_FINGERPRINT = "fingerprint"


Report = dict[str, Any]


@contextmanager
def complete_results(place: Path, fingerprint: str) -> Iterator[tuple[OutputFolder, Report]]:
    """Yield an empty folder and an empty report; when both are filled, they appear at ``place``.

    The folder replaces one that contains only what an earlier run wrote. If the caller fails,
    nothing changes at ``place``.

    Parameters
    ----------
    place : Path
    fingerprint : str
        Of everything that the results depend on; :func:`report_of` asks for it.

    Raises
    ------
    InputError
        The folder contains files that no command wrote.
    OSError
        The disk is full or not writable.
    """
    with fresh_folder(place) as fresh:
        folder, report = OutputFolder(fresh), Report()
        yield folder, report
        text = json.dumps(plain({**report, _FINGERPRINT: fingerprint}), indent=2) + "\n"
        folder.write(MEASURED, lambda path: _write_text(path, text))
        replace_folder(fresh, place, own_files)


def report_of(place: Path, fingerprint: str) -> Mapping[str, Any] | None:
    """Return the report of complete results with this fingerprint; None if there are none."""
    try:
        report = json.loads(read_text(place / MEASURED))
        sizes = {entry["file"]: entry["size"] for entry in OutputFolder(place).written()}
        complete = all((place / name).stat().st_size == size for name, size in sizes.items())
    except (InputError, ValueError, OSError):
        return None
    same = isinstance(report, dict) and report.get(_FINGERPRINT) == fingerprint
    return report if same and complete else None


def own_files(place: Path) -> list[Path]:
    """Return the files of a folder that contains only what a command wrote.

    Raises
    ------
    InputError
        The folder contains something else; the message names it.
    """
    if not place.is_dir():
        raise InputError(f"{place} is a file; move it away or name another --out folder")
    ours = {(e["file"], e["size"], e["mtime_ns"]) for e in OutputFolder(place).written()}
    files = [file for file in sorted(place.iterdir()) if file.name != WRITTEN]
    for file in files:
        found = file.lstat()
        if (file.name, found.st_size, found.st_mtime_ns) not in ours:
            raise InputError(
                f"{file} is not as tactile wrote it, and would be lost; move it away or name "
                f"another --out folder"
            )
    return [*files, place / WRITTEN] if (place / WRITTEN).is_file() else files


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
