"""Names of what is not finished yet, and what processes that were killed left under them."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import socket
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

State = Literal["new", "old"]
"""``new`` has never been at its place; ``old`` may hold what was there before."""

_LONGEST_LABEL = 150
_NAME = re.compile(
    r"\.(?P<label>.+)\.tactile-(?P<where>[0-9a-f]{8})-(?P<pid>[0-9]{1,9})-[0-9a-f]{8}"
    r"\.(?P<state>new|old)",
    re.DOTALL,
)


def beside(path: Path, state: State = "new") -> Path:
    """Return a fresh hidden name in the folder of ``path``, marked as this process's."""
    owner = f"{_this_machine()}-{os.getpid()}-{secrets.token_hex(4)}"
    return path.with_name(f".{_label(path)}.tactile-{owner}.{state}")


def remove_leftovers(folder: Path) -> None:
    """Remove the unfinished files and folders of processes of this machine that have ended.

    What is ``old``, or another machine's, or of a process that still runs, is left alone.
    """
    for path, found in _abandoned(folder):
        if found["state"] == "new":
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                with suppress(OSError):
                    path.unlink()


def replaced(place: Path) -> list[Path]:
    """Return what processes that have ended took from this place and did not remove."""
    label = _label(place)
    return [
        path
        for path, found in _abandoned(place.parent)
        if found["state"] == "old" and found["label"] == label
    ]


def _abandoned(folder: Path) -> Iterator[tuple[Path, re.Match[str]]]:
    try:
        paths = list(folder.iterdir())
    except OSError:
        return
    for path in paths:
        found = _NAME.fullmatch(path.name)
        if found and found["where"] == _this_machine() and not _runs(int(found["pid"])):
            yield path, found


def _label(path: Path) -> str:
    """The name, or a fingerprint where it leaves no room for the rest."""
    name = os.fsencode(path.name)
    return path.name if len(name) <= _LONGEST_LABEL else hashlib.sha256(name).hexdigest()


def _runs(pid: int) -> bool:
    if sys.platform == "win32":  # os.kill would end it
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        return True
    return True


@cache
def _this_machine() -> str:
    """Tell hosts apart, and containers: a process number means nothing in another one."""
    try:
        numbered_in = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        numbered_in = 0
    words = f"{socket.gethostname()}\0{numbered_in}"
    return hashlib.sha256(words.encode("utf-8", "backslashreplace")).hexdigest()[:8]
