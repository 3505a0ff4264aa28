"""Injected faults: failing disks, and signals during a file operation."""

from __future__ import annotations

import errno
import os
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_CHANGES = frozenset({"os.rename", "os.mkdir", "os.link", "os.symlink", "os.truncate"})
_REMOVALS = frozenset({"os.remove", "os.rmdir"})


@dataclass(frozen=True)
class Fault:
    """A fault at the nth file operation.

    Attributes
    ----------
    number : int
        An ``errno``; 0 for a signal or a limit.
    at : int
        Index of the first failing operation, from 0.
    reading : bool
        Count read operations instead of writes.
    lasting : bool
        All later operations fail as well.
    signal : int
        Signal for the process instead of an error.
    limit_bytes : int or None
        Largest size of a file; a longer write is truncated.
    """

    number: int = errno.ENOSPC
    at: int = 0
    reading: bool = False
    lasting: bool = True
    signal: int = 0
    limit_bytes: int | None = None

    def install(self, root: Path, fired: Callable[[str], None]) -> None:
        """Inject the fault in this process, for all files below a folder."""
        if self.limit_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (self.limit_bytes, self.limit_bytes))
            return
        seen = 0

        def hook(event: str, arguments: tuple[Any, ...]) -> None:
            nonlocal seen
            path = self._concerned(event, arguments)
            if path is None or not _within(path, root):
                return
            seen += 1
            if seen <= self.at or (seen > self.at + 1 and not self.lasting):
                return
            if self.signal:
                if seen == self.at + 1:
                    fired(event)
                    os.kill(os.getpid(), self.signal)
                return
            fired(event)
            raise OSError(self.number, os.strerror(self.number), path)

        sys.addaudithook(hook)

    def _concerned(self, event: str, arguments: tuple[Any, ...]) -> str | None:
        """Return the path of an operation that the fault affects, or None."""
        changes = event in _CHANGES or (self.signal != 0 and event in _REMOVALS)
        if event == "open":
            changes = (int(arguments[2] or 0) & _WRITING != 0) is not self.reading
        elif self.reading or not changes:
            return None
        path = arguments[0]
        if not changes or isinstance(path, int) or path is None:
            return None
        if self.reading and Path(path).is_dir():  # listed to be removed
            return None
        return os.fsdecode(path)


def _within(path: str, root: Path) -> bool:
    return os.path.abspath(path).startswith(f"{root}{os.sep}")  # noqa: PTH100  (no links followed)
