"""A file that grows by whole writes, so that what it holds is readable at any time."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path


class AppendedFile:
    """A new file whose every write reaches the operating system at once, whole or not at all.

    Parameters
    ----------
    path : Path

    Raises
    ------
    OSError
        The file exists, or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        self._number = os.open(path, flags, 0o666)
        self._size = 0

    def write(self, data: bytes | bytearray | memoryview) -> int:
        """Append data.

        Raises
        ------
        OSError
            It does not fit on the disk; nothing of it stays.
        """
        left = memoryview(data)
        try:
            while left:
                left = left[os.write(self._number, left) :]
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self._number, self._size)
            raise OSError(error.errno, error.strerror, str(self._path)) from None
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """Return the size, bytes."""
        return self._size

    def check(self) -> None:
        """Check that the file still has a name.

        Raises
        ------
        FileNotFoundError
            The file was deleted, so that all that follows would be lost.
        """
        if os.fstat(self._number).st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, "it was deleted", str(self._path))

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._number >= 0:
            number, self._number = self._number, -1
            os.close(number)
