"""HDF5 files of columns that grow, on a disk that may be full for a while."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

with suppress(ImportError):
    import hdf5plugin  # noqa: F401  (registers filters, such as blosc2)


class PatientDisk(FileIO):
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
        super().__init__(path, "x+b")
        self._size = 0
        self._refused: list[tuple[int, bytes]] = []
        self._path = path
        self._error: BaseException | None = None

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to an offset from the beginning, or from the end."""
        return super().seek(offset + (self._size if whence == os.SEEK_END else 0))

    def write(self, data: Any) -> int:
        """Write all of the data, to the disk or to memory."""
        view, at, done = memoryview(data).cast("B"), self.tell(), 0
        try:
            while self._error is None and done < len(view):
                done += super().write(view[done:])
        except OSError as error:
            self._error = OSError(error.errno, error.strerror, str(self._path))
        except BaseException as error:  # such as Ctrl-C, which must not reach HDF5 either
            self._error = error
        if done < len(view):
            self._refused.append((at + done, bytes(view[done:])))
        self._size = max(self._size, self.seek(at + len(view)))
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Read what was written; what never was is zero."""
        view = memoryview(buffer).cast("B")
        begin, length, found = self.tell(), len(view), b""
        try:
            found = os.pread(self.fileno(), length, begin)
        except BaseException as error:
            self._error = self._error or error
        view[:] = found.ljust(length, b"\0")
        for at, data in self._refused:
            first, last = max(at, begin), min(at + len(data), begin + length)
            if first < last:
                view[first - begin : last - begin] = data[first - at : last - at]
        self.seek(begin + length)
        return length

    def truncate(self, size: int | None = None) -> int:
        """Set the size."""
        self._size = self.tell() if size is None else size
        try:
            if self._error is None:
                super().truncate(self._size)
        except BaseException as error:
            self._error = error
        return self._size

    def check(self) -> None:
        """Raise the first error."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Close the file, and raise what the disk has refused; may be called twice."""
        if not self.closed:
            super().close()
            self._refused.clear()
            self.check()


END = "_end"  # Added to the name of a column of bytes: the column with the end of each row


class _Column(NamedTuple):
    """Rows that wait to be written."""

    rows: list[NDArray[Any]]
    begin: int
    attributes: Mapping[str, Any]
    compressed: bool


class ColumnFile:
    """Writes a new HDF5 file, whose every chunk has a checksum.

    Parameters
    ----------
    path : Path
        Must not exist.

    Raises
    ------
    OSError
        The file exists, or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._disk = PatientDisk(path)
        self._file: h5py.File | None = h5py.File(self._disk, "w", libver=("v110", "v110"))
        self._waiting: dict[str, _Column] = {}
        self._waiting_bytes = 0
        self._ends: dict[str, int] = {}

    def describe(self, attributes: Mapping[str, str | int]) -> None:
        """Set attributes of the file."""
        self._opened.attrs.update(attributes)

    def put(self, name: str, data: bytes) -> None:
        """Write bytes that are complete, as a dataset of uint8."""
        content = np.frombuffer(data, np.uint8)
        checked = {"chunks": (max(1, len(content)),), "fletcher32": True} if data else {}
        self._opened.create_dataset(name, data=content, **checked)
        self._disk.check()

    def append(
        self,
        name: str,
        rows: NDArray[Any],
        *,
        begin: int = 0,
        attributes: Mapping[str, Any] | None = None,
        compressed: bool = False,
    ) -> None:
        """Append rows to a column.

        Parameters
        ----------
        name : str
        rows : (n, ...) array
            Must not change afterwards. Shape of a row and dtype are those of the column.
        begin : int
            Rows before the first one of a new column; they are 0, or NaN.
        attributes : mapping, optional
            Of a new column.
        compressed : bool
            Whether a new column is compressed, with one row in a chunk.

        Raises
        ------
        OSError
            The disk is full.
        """
        if name not in self._waiting:
            self._waiting[name] = _Column([], begin, attributes or {}, compressed)
        self._waiting[name].rows.append(rows)
        self._waiting_bytes += rows.nbytes
        if self._waiting_bytes > (1 << 24):  # [bytes] written together
            self._write()

    def append_bytes(self, name: str, data: bytes) -> None:
        """Append a row of any length to a column of bytes."""
        end = self._ends[name] = self._ends.get(name, 0) + len(data)
        self.append(name, np.frombuffer(data, np.uint8))
        self.append(name + END, np.array([end], np.int64))

    def close(self) -> None:
        """Write what waits and close the file; may be called twice.

        Raises
        ------
        OSError
            Not everything is on the disk.
        """
        if self._file is None:
            return
        try:
            self._write()
        finally:
            file, self._file = self._file, None
            file.close()
            self._disk.close()

    @property
    def _opened(self) -> h5py.File:
        assert self._file is not None
        return self._file

    def _write(self) -> None:
        self._disk.check()
        waiting, self._waiting, self._waiting_bytes = self._waiting, {}, 0
        for name, column in waiting.items():
            if name not in self._opened:
                self._create(name, column)
            dataset = self._opened[name]
            rows = column.rows[0] if len(column.rows) == 1 else np.concatenate(column.rows)
            begin = len(dataset)
            if len(rows):
                dataset.resize(begin + len(rows), axis=0)
                dataset[begin:] = rows
            self._disk.check()

    def _create(self, name: str, column: _Column) -> None:
        first = column.rows[0]
        row_bytes = max(1, first.dtype.itemsize * int(np.prod(first.shape[1:])))
        # [bytes] of a chunk; columns of bytes are long
        size = 1 << 16 if row_bytes == 1 else 1 << 13
        rows = 1 if column.compressed else max(1, size // row_bytes)
        gzip = {"compression": "gzip", "compression_opts": 1} if column.compressed else {}
        dataset = self._opened.create_dataset(
            name,
            shape=(column.begin, *first.shape[1:]),
            maxshape=(None, *(n or None for n in first.shape[1:])),
            dtype=first.dtype,
            chunks=(rows, *(max(1, n) for n in first.shape[1:])),
            fillvalue=np.nan if first.dtype.kind == "f" else None,
            fletcher32=True,
            **gzip,
        )
        dataset.attrs.update(column.attributes)
