"""What all formats share: reading with a clear word on failure, writing whole or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.unfinished import beside

MOST_BYTES = 1 << 30
"""No file that is read whole is larger; videos are not read whole."""

MOST_TEXT_BYTES = 10_000_000
"""A table of 100,000 labelled presses has half of that."""


def status(path: Path) -> os.stat_result:
    """Return what the file system knows of a file or folder.

    Raises
    ------
    InputError
        There is none of this name, or it may not be looked at.
    """
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: there is no such file or folder; check the path") from None
    except PermissionError:
        raise InputError(f"{path} may not be read; change its permissions") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; check the path") from None
    except ValueError as error:  # NUL in the name, or a character that no name can have here
        raise InputError(f"{path} is no name of a file: {error}") from None


def regular(path: Path) -> Path:
    """Return a path that leads to a file which has an end, unlike a pipe or a device.

    Raises
    ------
    InputError
        There is no such file, it is a folder, a pipe, a socket or a device, or may not be read.
    """
    mode = status(path).st_mode
    if stat.S_ISDIR(mode):
        raise InputError(f"{path} is a folder; name the file in it")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path} is a pipe or a device, no file; copy what it gives into a file")
    return path


def is_file(path: Path) -> bool:
    """Whether a path leads to a regular file; of a name that is too long, too."""
    try:
        return regular(path) == path
    except InputError:
        return False


def expanded(path: str | Path) -> Path:
    """Return a path with ``~`` and ``~user`` replaced by the home folder.

    Raises
    ------
    InputError
        There is no such user.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise InputError(f"{path}: there is no such user's home folder; check the path") from None


def read_bytes(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """Return a file's content.

    Raises
    ------
    InputError
        There is no such file, it is no regular file, is too large, or may not be read.
    """
    size = status(regular(path)).st_size
    if size > most_bytes:
        raise InputError(
            f"{path} has {size / 1e6:.0f} MB, too large for what it should be; check the path"
        )
    # not all that comes: some files of the system say 0 and never end
    return read_start(path, size)


def read_start(path: Path, count: int) -> bytes:
    """Return the first ``count`` bytes of a file, or all of a shorter one.

    Raises
    ------
    InputError
        There is no such file, it is no regular file, or may not be read.
    """
    try:
        with regular(path).open("rb") as file:
            return file.read(count)
    except PermissionError:
        raise InputError(f"{path} may not be read; change its permissions") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}; copy it anew") from None


def read_text(path: Path, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Return a text file's content; a byte order marker is dropped.

    Raises
    ------
    InputError
        As :func:`read_bytes`, or it is no text in UTF-8.
    """
    try:
        return read_bytes(path, most_bytes).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is no text file in UTF-8") from None


def write_atomically(path: Path, data: bytes | bytearray | memoryview) -> None:
    """Write a file whole or not at all: beside its place first, then into it.

    Raises
    ------
    OSError
        The disk is full or refuses; what was at ``path`` before is still there, and nothing else.
    """
    write_together({Path(path): data})


def write_together(files: Mapping[Path, bytes | bytearray | memoryview]) -> None:
    """Write files whole, all of them or none: beside their places first, then into them.

    Raises
    ------
    OSError
        The disk is full or refuses; what was at each path before is still there, and nothing else.
    """
    # not tempfile: its files are readable by their owner only, whatever the user's umask says
    fresh = {path: beside(path) for path in files}
    try:
        for path, data in files.items():
            with fresh[path].open("xb") as file:
                file.write(data)
        for path in files:
            fresh[path].replace(path)
    except BaseException:
        for left in fresh.values():
            left.unlink(missing_ok=True)
        raise


def plain_text(text: str) -> str:
    r"""Return a text that any file can hold: half of a surrogate pair becomes ``\udc80``.

    Names of files that are not UTF-8 have such halves in Python.
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
