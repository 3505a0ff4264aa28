"""Snapshots of the threads and open files of the process, to detect leaks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_FDS = Path("/proc/self/fd")
_GRACE_S = 0.5  # Time that threads have to end after close(), s

_POLL_S = 0.01  # Interval between two looks at the threads, s


@dataclass(frozen=True)
class Footprint:
    """The threads of the process, and its open files with their targets (on Linux)."""

    threads: frozenset[threading.Thread]
    files: frozenset[tuple[str, str]]

    @classmethod
    def now(cls) -> Footprint:
        """Return the current threads and open files."""
        return cls(frozenset(threading.enumerate()), frozenset(_open_files()))

    def left(self) -> str:
        """Return the threads and files that are new since the snapshot, or ""."""
        until = time.monotonic() + _GRACE_S
        while (added := self._added()) and time.monotonic() < until:
            time.sleep(_POLL_S)
        return added

    def _added(self) -> str:
        now = Footprint.now()
        threads = [f"the thread {thread.name!r}" for thread in now.threads - self.threads]
        files = [f"the open file {target}" for _, target in sorted(now.files - self.files)]
        return ", ".join(threads + files)


@dataclass(frozen=True)
class Outcome:
    """The result of a call with a time limit.

    Attributes
    ----------
    took_s : float
        Time until the call ended, or until the limit.
    ended : bool
        False if the call is still running.
    value, error : object, BaseException or None
    """

    took_s: float
    ended: bool
    value: Any = None
    error: BaseException | None = None


def within(limit_s: float, action: Callable[[], Any]) -> Outcome:
    """Run an action in a new thread and wait for it for at most ``limit_s``."""
    results: dict[str, Any] = {}

    def run() -> None:
        try:
            results["value"] = action()
        except BaseException as error:
            results["error"] = error

    thread = threading.Thread(target=run, name="conformance", daemon=True)
    began = time.monotonic()
    thread.start()
    thread.join(limit_s)
    return Outcome(time.monotonic() - began, not thread.is_alive(), **results)


def _open_files() -> list[tuple[str, str]]:
    found = []
    for entry in _FDS.iterdir() if _FDS.is_dir() else ():
        try:
            found.append((entry.name, str(entry.readlink())))
        except OSError:
            continue  # the descriptor that lists the folder
    return found
