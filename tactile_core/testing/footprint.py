"""What a device holds of the process: threads and open files."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_FDS = Path("/proc/self/fd")
_GRACE_S = 0.5
_POLL_S = 0.01


@dataclass(frozen=True)
class Footprint:
    """Threads, and open files with what they lead to (where the system tells)."""

    threads: frozenset[threading.Thread]
    files: frozenset[tuple[str, str]]

    @classmethod
    def now(cls) -> Footprint:
        """The process as it is."""
        return cls(frozenset(threading.enumerate()), frozenset(_open_files()))

    def left(self) -> str:
        """Say what is there now that was not then, once threads have had time to end."""
        until = time.monotonic() + _GRACE_S
        while (said := self._added()) and time.monotonic() < until:
            time.sleep(_POLL_S)
        return said

    def _added(self) -> str:
        now = Footprint.now()
        threads = [f"the thread {thread.name!r}" for thread in now.threads - self.threads]
        files = [f"the open file {target}" for _, target in sorted(now.files - self.files)]
        return ", ".join(threads + files)


@dataclass(frozen=True)
class Outcome:
    """How a call ended.

    Attributes
    ----------
    took_s : float
        Until it ended, or until nobody waited any longer.
    ended : bool
    value, error : object, BaseException or None
    """

    took_s: float
    ended: bool
    value: Any = None
    error: BaseException | None = None


def within(limit_s: float, action: Callable[[], Any]) -> Outcome:
    """Run an action in a thread of its own and wait for it no longer than that."""
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
