"""Names of temporary files and folders, and the removal of those that killed processes left."""

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

# `new`: not yet moved to its final path. `old`: may contain what was replaced.
State = Literal["new", "old"]

# Longest file name that a temporary name includes, bytes; file systems allow 255 in all.
_MAX_LABEL_BYTES = 150

# A temporary name: final name, machine, process number, random digits and state.
_NAME = re.compile(
    r"\.(?P<label>.+)\.tactile-(?P<where>[0-9a-f]{8})-(?P<pid>[0-9]{1,9})-[0-9a-f]{8}"
    r"\.(?P<state>new|old)",
    re.DOTALL,
)


def temporary_path(path: Path, state: State = "new") -> Path:
    """Return an unused hidden name in the folder of ``path`` that identifies this process."""
    owner = f"{_this_machine()}-{os.getpid()}-{secrets.token_hex(4)}"
    return path.with_name(f".{_label(path)}.tactile-{owner}.{state}")


def remove_leftovers(folder: Path) -> None:
    """Remove the ``new`` files and folders of processes of this machine that have ended.

    Those that are ``old``, of another machine or of a running process are kept.
    """
    for path, found in _abandoned(folder):
        if found["state"] == "new":
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                with suppress(OSError):
                    path.unlink()


def replaced(place: Path) -> list[Path]:
    """Return the replaced versions of this path that ended processes did not remove."""
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
    """Return the name, or a fingerprint of a name that is too long."""
    name = os.fsencode(path.name)
    return path.name if len(name) <= _MAX_LABEL_BYTES else hashlib.sha256(name).hexdigest()


def _runs(pid: int) -> bool:
    if sys.platform == "win32":  # os.kill would end the process
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
    """Identify the host and container in which process numbers are valid."""
    try:
        numbered_in = Path("/proc/self/ns/pid").stat().st_ino
    except OSError:
        numbered_in = 0
    words = f"{socket.gethostname()}\0{numbered_in}"
    return hashlib.sha256(words.encode("utf-8", "backslashreplace")).hexdigest()[:8]
