"""Files that are read within limits, and written whole or not at all."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
import socket
import stat
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Literal

from tactile_core.errors import InputError

# Largest image, pixels. Cameras of such sensors have at most 20 megapixels, and measuring takes
# about fifty bytes per pixel.
MAX_PIXELS = 50_000_000

# `new`: not yet moved to its final path. `old`: may contain what was replaced.
State = Literal["new", "old"]

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
    for path, found in _find_abandoned(folder):
        if found["state"] == "new":
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                with suppress(OSError):
                    path.unlink()


def find_replaced(place: Path) -> list[Path]:
    """Return the replaced versions of this path that ended processes did not remove."""
    label = _label(place)
    return [
        path
        for path, found in _find_abandoned(place.parent)
        if found["state"] == "old" and found["label"] == label
    ]


def _find_abandoned(folder: Path) -> Iterator[tuple[Path, re.Match[str]]]:
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
    # [bytes] File systems allow 255 in all
    return path.name if len(name) <= 150 else hashlib.sha256(name).hexdigest()


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


# Largest file that is read into memory, bytes. Videos are read frame by frame instead.
MAX_BYTES = 1 << 30

# Largest text file, bytes; twice the size of a table of 100,000 labelled presses.
MAX_TEXT_BYTES = 10_000_000


def status(path: Path) -> os.stat_result:
    """Return the status of a file or folder, as :meth:`pathlib.Path.stat` does.

    Raises
    ------
    InputError
        The path does not exist or is not accessible.
    """
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: there is no such file or folder; check the path") from None
    except PermissionError:
        raise InputError(f"{path}: permission to read denied; change its permissions") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; check the path") from None
    except ValueError as error:  # NUL, or a character that this system's file names cannot contain
        raise InputError(f"{path} is not a valid file name: {error}") from None


def regular(path: Path) -> Path:
    """Return the path of a regular file; a pipe or a device could be read forever.

    Raises
    ------
    InputError
        The file does not exist, is not accessible, or is a folder, pipe, socket or device.
    """
    mode = status(path).st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path} is a folder; name a file in it")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path} is a pipe or a device, not a file; save its output as a file")
    return path


def is_file(path: Path) -> bool:
    """Whether a path is that of a regular file; False for an invalid or too long name."""
    try:
        return regular(path) == path
    except InputError:
        return False


def expand_home(path: str | Path) -> Path:
    """Return a path with ``~`` and ``~user`` replaced by the home folder.

    Raises
    ------
    InputError
        The user does not exist.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise InputError(f"{path}: this user has no home folder; check the path") from None


def read_bytes(path: Path, max_bytes: int = MAX_BYTES) -> bytes:
    """Return a file's content.

    Raises
    ------
    InputError
        The file does not exist, is not a regular file, is too large or is not accessible.
    """
    size = status(regular(path)).st_size
    if size > max_bytes:
        raise InputError(
            f"{path} has {size / 1e6:.0f} MB, too large for a file of this kind; check the path"
        )
    # never more than the reported size: some system files report 0 bytes and never end
    return read_start(path, size)


def read_start(path: Path, count: int) -> bytes:
    """Return the first ``count`` bytes of a file, or all of a shorter one.

    Raises
    ------
    InputError
        The file does not exist, is not a regular file or is not accessible.
    """
    try:
        with regular(path).open("rb") as file:
            return file.read(count)
    except PermissionError:
        raise InputError(f"{path}: permission to read denied; change its permissions") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; copy it again") from None


def read_text(path: Path, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """Return a text file's content; a leading BOM is dropped.

    Raises
    ------
    InputError
        As :func:`read_bytes`, or the file is not UTF-8 text.
    """
    try:
        return read_bytes(path, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file in UTF-8") from None


def write_atomically(path: Path, data: bytes | bytearray | memoryview) -> None:
    """Write a file completely or not at all: to a temporary file first, which is then renamed.

    Raises
    ------
    OSError
        The disk is full or not writable. An existing file at ``path`` is kept, and no temporary
        file remains.
    """
    write_together({Path(path): data})


def write_together(files: Mapping[Path, bytes | bytearray | memoryview]) -> None:
    """Write all files completely, or none of them: to temporary files first, which are renamed.

    Raises
    ------
    OSError
        The disk is full or not writable. Existing files are kept, and no temporary file remains.
    """
    # not tempfile: only the owner can read its files, whatever the umask
    temporary = {path: temporary_path(path) for path in files}
    try:
        for path, data in files.items():
            with temporary[path].open("xb") as file:
                file.write(data)
        for path in files:
            temporary[path].replace(path)
    except BaseException:
        for left in temporary.values():
            left.unlink(missing_ok=True)
        raise


def plain_text(text: str) -> str:
    r"""Return text that can be encoded: a lone surrogate becomes its escape, e.g. ``\udc80``.

    Python puts lone surrogates into file names that are not UTF-8.
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
