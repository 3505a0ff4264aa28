"""A case's own copy of the valid inputs, and the list of its files."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
from collections.abc import Mapping
from pathlib import Path

Listing = Mapping[str, str]
"""Content by relative name: a file's digest, ``folder``, a link's target or ``other``."""


class Sandbox:
    """Folders of a case: ``work`` with the inputs is the current one; also ``home`` and ``tmp``."""

    def __init__(self, root: Path, corpus: Path) -> None:
        self.root = root
        self.work = root / "user" / "work"
        self.home = root / "home"
        self.tmp = root / "tmp"
        for folder in (self.work.parent, self.home, self.tmp):
            folder.mkdir(parents=True)
        shutil.copytree(corpus, self.work)
        self.given: frozenset[str] = frozenset()

    def listing(self) -> dict[str, str]:
        """List everything below the root; the folders of the first listing are the user's."""
        found: dict[str, str] = {}
        for folder, folders, files in os.walk(self.root):
            for name in (*folders, *files):
                path = Path(folder) / name
                found[str(path.relative_to(self.root))] = _what(path)
        if not self.given:
            folders = [self.root / name for name, what in found.items() if what == "folder"]
            self.given = frozenset(map(os.path.realpath, folders))
        return found

    def environment(self) -> dict[str, str]:
        """Return the environment variables for the user's folders."""
        return {
            "HOME": str(self.home),
            "XDG_DATA_HOME": str(self.home / "data"),
            "TMPDIR": str(self.tmp),
            "COLUMNS": "200",
        }


def _what(path: Path) -> str:
    mode = path.lstat().st_mode
    if stat.S_ISREG(mode):
        return hashlib.blake2b(path.read_bytes(), digest_size=12).hexdigest()
    if stat.S_ISDIR(mode):
        return "folder"
    return f"link to {path.readlink()}" if stat.S_ISLNK(mode) else "other"
