"""Folders of results, written one by one."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.formats.files import read_text, remove_leftovers, temporary_path
from tactile_core.formats.folders import fresh_folder, make_folder, rename_new, replace_folder
from tactile_core.formats.text import plain, printable
from tactile_core.recordings.inputs import Inputs

# Name of the list of written files in the folder: one JSON object per line, append-only.
WRITTEN = ".tactile-outputs"

REPORT = "report.html"

_HEADER = '{"written_by": "tactile-core"}'

_LONGEST_STEM = 200  # Bytes of a file name without its ending; file systems allow 255 in all
_UNSAFE = re.compile(r"[/\\\x00-\x1f\x7f-\x9f]")

_Stamp = tuple[int, int]


class OutputFolder:
    """The destination of a command's results.

    An existing file is replaced only if the folder's list shows that a command wrote it and its
    size and modification time have not changed since.

    Parameters
    ----------
    path : Path
        Created with the first file.
    inputs : Inputs, optional
        Files that results must not overwrite.

    Raises
    ------
    InputError
        The path or a parent is a file, or the folder is an input or contains a recording's file.
    """

    def __init__(self, path: Path | str, inputs: Inputs | None = None) -> None:
        self.path = Path(path)
        self._inputs = inputs or Inputs()
        for part in (self.path, *self.path.parents):
            if (part.exists() or part.is_symlink()) and not part.is_dir():
                what = "a file" if part.exists() else "a link that leads nowhere"
                raise InputError(f"{part} is {what}; name a folder for the results")
        self._inputs.refuse_shared(self.path)
        self._former = {(entry["file"], _stamp_of(entry)) for entry in self.read_entries()}
        self._made = False

    def check(self, names: Iterable[str]) -> None:
        """Refuse now what :meth:`write` would refuse for files of these names.

        Raises
        ------
        InputError
            A file of such a name exists that no command wrote.
        """
        for name in names:
            self._refuse_foreign(name, "")

    def check_for(self, sources: Iterable[str], endings: Collection[str]) -> None:
        """Refuse now what :meth:`write_for` would refuse later.

        Raises
        ------
        InputError
            Results of two observations would have the same name, or a file of such a name exists
            that no command wrote.
        """
        owners: dict[str, str] = {}
        for source in sources:
            for name in (safe_stem(source) + ending for ending in endings):
                if name in owners:
                    raise InputError(
                        f"results of {printable(owners[name])} and of {printable(source)} would "
                        f"both be {printable(name)}; rename one of these inputs, or measure them "
                        f"separately"
                    )
                owners[name] = source
        self.check(owners)

    def write_for(self, source: str, ending: str, writer: Callable[[Path], None]) -> Path:
        """Write one file of an observation, named after it; see :meth:`write`."""
        return self.write(safe_stem(source) + ending, writer, of=source)

    def write(self, name: str, writer: Callable[[Path], None], *, of: str = "") -> Path:
        """Write one file completely or not at all, and return its path.

        Parameters
        ----------
        name : str
        writer : callable
            Writes the content to the path that it receives.
        of : str
            Name of the observation, for messages.

        Raises
        ------
        InputError
            The file exists and is an input, was not written by a command, or was already written
            in this run.
        OSError
            The disk is full or not writable; an existing file is kept.
        """
        path = self.path / name
        self._make()
        self._refuse_foreign(name, of)
        fresh = temporary_path(path)
        try:
            writer(fresh)
            ours_is_there = self._refuse_foreign(name, of)
            # listed before it exists: a result that is not listed could never be replaced
            self._note(name, fresh, of)
            if ours_is_there:
                fresh.replace(path)
            else:
                _put(fresh, path)
        except BaseException:
            with suppress(OSError):
                fresh.unlink(missing_ok=True)
            raise
        return path

    def _make(self) -> None:
        if not self._made:
            make_folder(self.path)
            remove_leftovers(self.path)
            self._made = True

    def _refuse_foreign(self, name: str, of: str) -> bool:
        """Return whether a replaceable file exists; raise an error for any other file."""
        path = self.path / name
        try:
            found = path.lstat()
        except FileNotFoundError:
            return False
        self._inputs.refuse_file(path)
        stamp = found.st_size, found.st_mtime_ns
        if (name, stamp) in self._former:
            return True
        for entry in self.read_entries():
            if (entry["file"], _stamp_of(entry)) == (name, stamp):
                first = printable(entry["of"]) or "another result"
                raise InputError(
                    f"{path} was written for {first} in this run and would be written again for "
                    f"{printable(of) or 'another'}; give them different names"
                )
        raise _foreign(path)

    def read_entries(self) -> list[dict[str, Any]]:
        """Return the entries of the folder's list, with ``file``, ``of``, ``size``, ``mtime_ns``.

        Raises
        ------
        InputError
            The folder has a file of the list's name that is no list.
        """
        path = self.path / WRITTEN
        if not os.path.lexists(path):
            return []
        if path.is_symlink() or not path.is_file():
            raise _not_ours(path)
        lines = path.read_bytes().split(b"\n")
        if lines[0] != _HEADER.encode():
            raise _not_ours(path)
        # a line that a full disk truncated is ignored
        return [entry for line in lines[1:] if (entry := _entry(line)) is not None]

    def _note(self, name: str, fresh: Path, of: str) -> None:
        found = fresh.lstat()
        entry = {"file": name, "of": of, "size": found.st_size, "mtime_ns": found.st_mtime_ns}
        path = self.path / WRITTEN
        # one write in append mode: lines of two processes do not interleave
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        number = os.open(path, flags, 0o666)
        try:
            head = "" if os.fstat(number).st_size else _HEADER
            line = f"{head}\n{json.dumps(entry)}".encode()
            if os.write(number, line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        finally:
            os.close(number)


def safe_stem(source: str) -> str:
    """Return a valid file name for an observation; a changed name gets a fingerprint."""
    stem = _UNSAFE.sub("_", source)
    try:
        short = os.fsencode(stem)[:_LONGEST_STEM].decode("utf-8", "ignore")
        stem = stem if len(os.fsencode(stem)) <= _LONGEST_STEM else short
    except UnicodeEncodeError:  # not a valid file name
        stem = stem.encode("ascii", "replace").decode().replace("?", "_")[:_LONGEST_STEM]
    if stem == source and stem not in ("", ".", ".."):
        return stem
    marker = hashlib.sha256(source.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{stem.strip('.')}-{marker}"


def _put(fresh: Path, path: Path) -> None:
    try:
        rename_new(fresh, path)
    except FileExistsError:
        raise _foreign(path) from None


def _entry(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        return None
    kinds = {"file": str, "of": str, "size": int, "mtime_ns": int}
    ours = isinstance(entry, dict) and all(isinstance(entry.get(k), t) for k, t in kinds.items())
    return entry if ours else None


def _stamp_of(entry: dict[str, Any]) -> _Stamp:
    return entry["size"], entry["mtime_ns"]


def _foreign(path: Path) -> InputError:
    return InputError(
        f"{path} already exists and is not as tactile wrote it; move it away or name another "
        f"--out folder"
    )


def _not_ours(path: Path) -> InputError:
    return InputError(f"{path} is not a list that tactile wrote; name another --out folder")


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
        sizes = {entry["file"]: entry["size"] for entry in OutputFolder(place).read_entries()}
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
    ours = {(e["file"], e["size"], e["mtime_ns"]) for e in OutputFolder(place).read_entries()}
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
