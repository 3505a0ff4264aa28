"""Checks of what a plugin imports, and of what it leaves behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tactile_core.plugins.entry_points import Offer
from tactile_core.testing import import_probe as probe
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import CannotCheck, report


@dataclass(frozen=True)
class Imported:
    """The side effects of one import.

    Attributes
    ----------
    what : str
        The hooks' module, a command or a component.
    listed : bool
        Whether listing plugins and commands imports it.
    heavy : tuple of str
        Imported packages that take long to import.
    effects : tuple of str
        Changes of the process; none are reported of a heavy package, which has its own.
    output : str
        Text that it printed.
    """

    what: str
    listed: bool
    heavy: tuple[str, ...]
    effects: tuple[str, ...]
    output: str


class ImportChecks(Suite):
    """Side effects of loading the plugin."""

    @check()
    def test_light_import(self) -> None:
        """Loading a plugin's hooks and its commands imports no heavy package."""
        for found in self._imports():
            heavy = ", ".join(found.heavy) if found.listed else ""
            report(
                f"plugin {self.plugin!r}",
                heavy and f"{found.what} imports {heavy}",
                why="it slows down 'tactile --help', and all that lists plugins",
                do="import it in the module of the component that needs it, which is loaded on "
                "demand, or in the function of the command",
            )

    @check()
    def test_import_effects(self) -> None:
        """Importing what it registers prints nothing, and listing it has no effects."""
        for found in self._imports():
            effects = found.effects if found.listed and not found.heavy else ()
            printed = [f"prints {found.output[:60]!r}"] if found.output else []
            words = ", ".join([*effects, *printed])
            report(
                f"plugin {self.plugin!r}",
                words and f"importing {found.what} {words}",
                why="other programs import it, some only to list what is installed, and their "
                "output and settings are their own",
                do="do this in the component or command that needs it (for a device, in _open); "
                "log to logging.getLogger(__name__) and leave handlers to the program",
            )

    def _imports(self) -> tuple[Imported, ...]:
        if self.registered.plugin is None:
            raise CannotCheck("see the check 'registration'")
        return import_all(self.registered.plugin.offer, tuple(sys.path))


def _first_environment() -> dict[str, str]:
    """Return the environment at the start of this process (on Linux), else the current one."""
    try:
        entries = os.fsdecode(Path("/proc/self/environ").read_bytes()).split("\0")
    except OSError:
        return dict(os.environ)
    return dict(entry.split("=", 1) for entry in entries if "=" in entry)


@cache
def import_all(offer: Offer, path: tuple[str, ...]) -> tuple[Imported, ...]:
    """Import the module of an offer, and what it registers, in a fresh interpreter.

    What cannot be imported is left to other checks.

    Raises
    ------
    CannotCheck
        The import of the module fails there.
    """
    with TemporaryDirectory(prefix="tactile-probe-") as folder:
        result, printed = Path(folder) / "result.json", Path(folder) / "printed"
        arguments = [json.dumps(asdict(offer)), json.dumps(path), str(result)]
        with printed.open("wb") as stdout:
            done = subprocess.run(
                [sys.executable, str(probe.__file__), *arguments],
                env={**_first_environment(), "PYTHONDONTWRITEBYTECODE": "1"},
                stdout=stdout,
                stderr=subprocess.PIPE,
                text=True,
                timeout=120.0,  # [s] in a fresh interpreter
                check=False,
            )
        if not result.is_file():
            raise CannotCheck(f"{offer} cannot be imported separately: {done.stderr[-500:]}")
        found = json.loads(result.read_text(encoding="utf-8"))
        output = printed.read_bytes()
    if found[0]["error"]:
        raise CannotCheck(found[0]["error"])
    return tuple(
        Imported(
            one["what"],
            one["listed"],
            tuple(one["heavy"]),
            tuple(one["effects"]),
            output[slice(*one["printed"])].decode(errors="replace"),
        )
        for one in found
    )


_FDS = Path("/proc/self/fd")


@dataclass(frozen=True)
class Footprint:
    """The threads of the process, and its open files with their targets (on Linux)."""

    threads: frozenset[threading.Thread]
    files: frozenset[tuple[str, str]]

    @classmethod
    def take_snapshot(cls) -> Footprint:
        """Return the current threads and open files."""
        return cls(frozenset(threading.enumerate()), frozenset(_open_files()))

    def find_leaks(self) -> str:
        """Return the threads and files that are new since the snapshot, or ""."""
        until = time.monotonic() + 0.5  # [s] threads end meanwhile
        while (added := self._describe_added()) and time.monotonic() < until:
            time.sleep(0.01)  # [s]
        return added

    def _describe_added(self) -> str:
        now = Footprint.take_snapshot()
        threads = [f"the thread {thread.name!r}" for thread in now.threads - self.threads]
        files = [f"the open file {target}" for _, target in sorted(now.files - self.files)]
        return ", ".join(threads + files)


def find_leaks(use: Callable[[], object]) -> str:
    """Return what is left of a use, twice; what the first use acquires, libraries may keep."""
    use()
    for _ in range(2):
        before = Footprint.take_snapshot()
        use()
        if left := before.find_leaks():
            return left
    return ""


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
