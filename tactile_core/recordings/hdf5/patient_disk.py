"""A file that HDF5 can write and close even if the disk is full."""

from __future__ import annotations

import os
from io import RawIOBase
from pathlib import Path


class PatientDisk(RawIOBase):
    """A new file that keeps in memory what the disk refuses.

    HDF5 ends the process when a write fails and its file is used or closed after that. So no write
    fails here: from the first that the disk refuses, all are kept in memory, where they can be read
    back until the file is closed. :meth:`check` raises the error.

    Parameters
    ----------
    path : Path
        Must not exist.

    Raises
    ------
    OSError
        It exists, or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        self._number = os.open(path, flags, 0o666)
        self._at = self._size = 0
        self._refused: list[tuple[int, bytes]] = []
        self._path = path
        self._error: BaseException | None = None

    def seekable(self) -> bool:
        """Whether :meth:`seek` works: it does."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to an offset from the beginning, or from the end."""
        self._at = offset + (self._size if whence == os.SEEK_END else 0)
        return self._at

    def tell(self) -> int:
        """Return the offset."""
        return self._at

    def write(self, data: bytes | memoryview) -> int:  # type: ignore[override]
        """Write all of the data, to the disk or to memory."""
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self._error is None and done < len(view):
                done += os.pwrite(self._number, view[done:], self._at + done)
        except OSError as error:
            self._error = OSError(error.errno, error.strerror, str(self._path))
        except BaseException as error:  # such as Ctrl-C, which must not reach HDF5 either
            self._error = error
        if done < len(view):
            self._refused.append((self._at + done, bytes(view[done:])))
        self._at += len(view)
        self._size = max(self._size, self._at)
        return len(view)

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Read what was written; what never was is zero."""
        view = memoryview(buffer).cast("B")
        begin, length = self._at, len(view)
        found = b""
        try:
            found = os.pread(self._number, length, begin)
        except BaseException as error:
            self._error = self._error or error
        view[:] = found.ljust(length, b"\0")
        for at, data in self._refused:
            first, last = max(at, begin), min(at + len(data), begin + length)
            if first < last:
                view[first - begin : last - begin] = data[first - at : last - at]
        self._at += length
        return length

    def truncate(self, size: int | None = None) -> int:
        """Set the size."""
        self._size = self._at if size is None else size
        try:
            if self._error is None:
                os.ftruncate(self._number, self._size)
        except BaseException as error:
            self._error = error
        return self._size

    def check(self) -> None:
        """Raise the first error."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Close the file, and raise what the disk has refused; may be called twice."""
        if self.closed:
            return
        super().close()
        os.close(self._number)
        self._refused.clear()
        self.check()
