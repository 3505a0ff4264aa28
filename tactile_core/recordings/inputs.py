"""The inputs of a command, to make sure that its outputs never overwrite them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tactile_core.errors import InputError

# Name of the profile in messages; the profile is given by name or as a file.
PROFILE = "the profile"

# Options whose file can have other files of the same recording next to it.
RECORDED = frozenset({"--input", "--presses", "--reference", "--image"})

_Identity = tuple[int, int]


@dataclass(frozen=True)
class Inputs:
    """The files and folders that the user gave, by option.

    Attributes
    ----------
    paths : mapping of str to Path
        Existing paths only: reading a missing one fails anyway.
    """

    paths: Mapping[str, Path] = field(default_factory=dict)

    @classmethod
    def from_paths(cls, given: Mapping[str, Path | str | None]) -> Inputs:
        """Keep the paths that were given and exist."""
        paths = {words: Path(path) for words, path in given.items() if path is not None}
        there = {words: path for words, path in paths.items() if _identity(path) is not None}
        if PROFILE in there and not there[PROFILE].is_file():
            del there[PROFILE]  # a folder with the name of a profile
        return cls(there)

    def refuse_whole(self, folder: Path) -> None:
        """Refuse a folder that will be replaced completely if it is or contains an input.

        Raises
        ------
        InputError
        """
        for words, path in self.paths.items():
            _refuse_same(folder, words, path)
            if _identity(folder) in map(_identity, path.resolve().parents):
                raise InputError(
                    f"--out {folder} contains {words} ({path}), which would be lost; name another "
                    f"folder"
                )

    def refuse_shared(self, folder: Path) -> None:
        """Refuse a folder for results if it is an input or contains a file of a recording.

        Raises
        ------
        InputError
        """
        for words, path in self.paths.items():
            _refuse_same(folder, words, path)
            beside = words in RECORDED and path.is_file()
            if beside and _identity(folder) == _identity(path.resolve().parent):
                raise InputError(
                    f"--out {folder} contains {words} ({path}), which results could overwrite; "
                    f"name another folder"
                )

    def refuse_file(self, file: Path) -> None:
        """Refuse a file that is an input or a link to a file in an input folder.

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
    """Return device and inode, the same for every link to a file; None if it does not exist."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


def _identities(folder: Path) -> Iterator[_Identity | None]:
    for inside, _, names in os.walk(folder):
        yield from (_identity(Path(inside, name)) for name in names)
