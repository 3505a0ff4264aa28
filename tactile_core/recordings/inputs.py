"""What a command reads, so that nothing that it writes can hit any of it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tactile_core.errors import InputError

PROFILE = "the profile"
"""Given by name or as a file."""

RECORDED = frozenset({"--input", "--presses", "--reference", "--image"})
"""Where a file of these is, there may be others of the recording."""

_Identity = tuple[int, int]


@dataclass(frozen=True)
class Inputs:
    """Files and folders that were given, by the option that named each.

    Attributes
    ----------
    paths : mapping of str to Path
        What does not exist is of no account: reading it is going to be refused.
    """

    paths: Mapping[str, Path] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Mapping[str, Path | str | None]) -> Inputs:
        """Keep what was given and is there."""
        paths = {words: Path(path) for words, path in given.items() if path is not None}
        there = {words: path for words, path in paths.items() if _identity(path) is not None}
        if PROFILE in there and not there[PROFILE].is_file():
            del there[PROFILE]  # a folder that has the name of a profile
        return cls(there)

    def refuse_whole(self, folder: Path) -> None:
        """Refuse a folder that is going to be replaced whole if it is, or holds, an input.

        Raises
        ------
        InputError
        """
        for words, path in self.paths.items():
            _refuse_same(folder, words, path)
            if _identity(folder) in map(_identity, path.resolve().parents):
                raise InputError(
                    f"--out {folder} holds {words} ({path}), which would be lost; name another "
                    f"folder"
                )

    def refuse_shared(self, folder: Path) -> None:
        """Refuse a folder for results if it is an input, or has the file of a recording in it.

        Raises
        ------
        InputError
        """
        for words, path in self.paths.items():
            _refuse_same(folder, words, path)
            beside = words in RECORDED and path.is_file()
            if beside and _identity(folder) == _identity(path.resolve().parent):
                raise InputError(
                    f"--out {folder} holds {words} ({path}), which results could overwrite; name "
                    f"another folder"
                )

    def refuse_file(self, file: Path) -> None:
        """Refuse a file that is an input, or, by a link, one of the files in it.

        Raises
        ------
        InputError
        """
        linked = file.is_symlink() or (file.exists() and file.stat().st_nlink > 1)
        for words, path in self.paths.items():
            _refuse_same(file, words, path)
            if linked and path.is_dir() and _identity(file) in _identities(path):
                raise InputError(f"{file} is one of {words} ({path}); name another --out")


def _refuse_same(out: Path, words: str, path: Path) -> None:
    if _identity(out) is not None and _identity(out) == _identity(path):
        raise InputError(f"--out {out} is {words} ({path}) itself; name another --out")


def _identity(path: Path) -> _Identity | None:
    """What is one for all names of a file or folder; None where there is none."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


def _identities(folder: Path) -> Iterator[_Identity | None]:
    for inside, _, names in os.walk(folder):
        yield from (_identity(Path(inside, name)) for name in names)
