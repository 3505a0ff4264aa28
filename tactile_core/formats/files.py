"""What all formats share: reading with a clear word on failure, writing whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_core.errors import InputError
from tactile_core.formats.leftovers import beside


def read_bytes(path: Path) -> bytes:
    """Return a file's content.

    Raises
    ------
    InputError
        There is no such file, it is a folder, or it may not be read.
    """
    try:
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: there is no such file; check the path") from None
    except IsADirectoryError:
        raise InputError(f"{path} is a folder; name the file in it") from None
    except PermissionError:
        raise InputError(f"{path} may not be read; change its permissions") from None


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
