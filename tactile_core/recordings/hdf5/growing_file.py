"""An HDF5 file of columns that grow together and can be read while they are written.

It is written in HDF5's mode "single writer, multiple readers" (SWMR), in which the file on disk is
consistent at every moment, also after the program was killed. This mode has neither strings of
variable length nor new columns. Bytes of variable length are therefore one long column with the
end of each row in another, and a new column makes the file leave the mode for a moment.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.errors import InputError
from tactile_core.recordings.hdf5.incomplete_file import (
    HEADER_BYTES,
    IncompleteFile,
    end_of_file,
    is_being_written,
    is_header,
)

if TYPE_CHECKING:
    import h5py

FASTER = "TACTILE_HDF5"
"""Environment variable; ``blosc2`` compresses several times faster than gzip."""

END = "_end"
"""Added to the name of a column of bytes: the column with the end of each row."""

_VERSIONS = ("v110", "v110")
"""Version of the format: the oldest that can be read while it is written."""

_CHUNK_BYTES = 1 << 13
"""Size of a chunk of small rows, bytes."""

_LONG_CHUNK_BYTES = 1 << 16
"""Size of a chunk of a column of bytes."""

_WAITING_BYTES = 1 << 24
"""Rows in memory that are written without waiting for a flush, bytes."""


def import_h5py() -> Any:
    """Return the module ``h5py``, which can read blosc2 if ``hdf5plugin`` is installed.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        import h5py
    except ImportError:
        raise InputError(
            "HDF5 files need h5py, which is not installed; install it with: "
            "pip install 'tactile-core[record]'"
        ) from None
    with suppress(ImportError):
        import hdf5plugin  # noqa: F401  (registers its filters)
    return h5py


def open_growing(path: Path) -> h5py.File:
    """Open a file to read it, even while it grows, after its writer was killed, or truncated.

    What is missing or was not completely written raises an OSError only when it is read.

    Raises
    ------
    InputError
        It is no HDF5 file, or ``h5py`` is not installed.
    """
    h5py = import_h5py()
    try:
        return h5py.File(path, "r", locking=False)
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
    except OSError as error:
        if (file := _opened_incomplete(path)) is None:
            raise InputError(
                f"{path} is not a readable HDF5 file ({error}); copy or record it again"
            ) from None
    return file


def _opened_incomplete(path: Path) -> h5py.File | None:
    """Open a file that HDF5 refuses as it is; None if it is damaged, or no HDF5 file.

    HDF5 would wait for minutes for the writer of a truncated file to write the rest, and refuses
    one whose writer was killed while it made a new column.
    """
    h5py = import_h5py()
    with path.open("rb") as opened:
        header = opened.read(HEADER_BYTES)
    if not is_header(header):
        return None
    with suppress(OSError):
        if is_being_written(header) and path.stat().st_size >= end_of_file(header):
            return h5py.File(path, "r", libver="latest", swmr=True, locking=False)
    with suppress(OSError):
        return h5py.File(IncompleteFile(path), "r")
    return None


class _Column(NamedTuple):
    """Rows that wait to be written."""

    rows: list[NDArray[Any]]
    begin: int
    attributes: Mapping[str, Any]
    compressed: bool


class GrowingFile:
    """Writes a new HDF5 file; what was flushed is there if the program is killed.

    Parameters
    ----------
    path : Path
        Must not exist.

    Raises
    ------
    InputError
        ``h5py`` is not installed.
    OSError
        The file exists, or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._h5py, self._compression = import_h5py(), _compression()
        self._path = path
        self._file: h5py.File | None = self._h5py.File(path, "x", libver=_VERSIONS, locking=False)
        self._waiting: dict[str, _Column] = {}
        self._waiting_bytes = 0
        self._ends: dict[str, int] = {}

    def describe(self, attributes: Mapping[str, str | int]) -> None:
        """Set attributes of the file; only before anything is flushed."""
        self._opened.attrs.update(attributes)

    def reserve(self, groups: Iterable[str], columns: Mapping[str, DTypeLike]) -> None:
        """Create groups, and columns without rows.

        A truncated file has lost a group that grew after its end, with all that was in it.
        """
        self._leave_swmr()
        for name in groups:
            self._opened.create_group(name)
        for name, dtype in columns.items():
            self._create(name, _Column([np.empty(0, dtype)], 0, {}, compressed=False))

    def put(self, name: str, data: bytes) -> None:
        """Write bytes that are complete, as a dataset of uint8."""
        self._leave_swmr()
        self._opened.create_dataset(name, data=np.frombuffer(data, np.uint8))

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
        """
        if name not in self._waiting:
            self._waiting[name] = _Column([], begin, attributes or {}, compressed)
        self._waiting[name].rows.append(rows)
        self._waiting_bytes += rows.nbytes
        if self._waiting_bytes > _WAITING_BYTES:
            self._write()

    def append_bytes(self, name: str, data: bytes) -> None:
        """Append a row of any length to a column of bytes."""
        end = self._ends[name] = self._ends.get(name, 0) + len(data)
        self.append(name, np.frombuffer(data, np.uint8))
        self.append(name + END, np.array([end], np.int64))

    def flush(self) -> None:
        """Write everything that waits, and hand it to the operating system."""
        self._write()
        if not self._opened.swmr_mode:
            self._opened.swmr_mode = True
        self._opened.flush()

    def close(self) -> None:
        """Write what waits and close the file; may be called twice."""
        if self._file is None:
            return
        try:
            self._write()
        finally:
            file, self._file = self._file, None
            file.close()

    @property
    def _opened(self) -> h5py.File:
        if self._file is None:
            raise OSError(f"{self._path} is closed")
        return self._file

    def _write(self) -> None:
        waiting, self._waiting, self._waiting_bytes = self._waiting, {}, 0
        try:
            self._write_all(waiting)
        except RuntimeError as error:  # of HDF5, such as a full disk
            raise OSError(f"{self._path} cannot be written: {error}") from error

    def _write_all(self, waiting: Mapping[str, _Column]) -> None:
        new = [name for name in waiting if name not in self._opened]
        if new:
            self._leave_swmr()
        for name in new:
            self._create(name, waiting[name])
        for name, column in waiting.items():
            dataset = self._opened[name]
            rows = column.rows[0] if len(column.rows) == 1 else np.concatenate(column.rows)
            begin = len(dataset)
            if len(rows):
                dataset.resize(begin + len(rows), axis=0)
                dataset[begin:] = rows

    def _create(self, name: str, column: _Column) -> None:
        first = column.rows[0]
        row_bytes = max(1, first.dtype.itemsize * int(np.prod(first.shape[1:])))
        size = _LONG_CHUNK_BYTES if row_bytes == 1 else _CHUNK_BYTES
        rows = 1 if column.compressed else max(1, size // row_bytes)
        dataset = self._opened.create_dataset(
            name,
            shape=(column.begin, *first.shape[1:]),
            maxshape=(None, *(n or None for n in first.shape[1:])),
            dtype=first.dtype,
            chunks=(rows, *(max(1, n) for n in first.shape[1:])),
            fillvalue=np.nan if first.dtype.kind == "f" else None,
            **(self._compression if column.compressed else {}),
        )
        dataset.attrs.update(column.attributes)

    def _leave_swmr(self) -> None:
        if self._opened.swmr_mode:
            self._opened.close()
            self._file = self._h5py.File(self._path, "r+", libver=_VERSIONS, locking=False)


def _compression() -> dict[str, Any]:
    """Return the options of compressed columns: gzip, or blosc2 if :data:`FASTER` asks for it."""
    if os.environ.get(FASTER, "") != "blosc2":
        return {"compression": "gzip", "compression_opts": 1}
    try:
        import hdf5plugin
    except ImportError:
        raise InputError(
            f"{FASTER}=blosc2 needs hdf5plugin, which is not installed; install it with: "
            f"pip install hdf5plugin"
        ) from None
    return dict(hdf5plugin.Blosc2(cname="zstd", clevel=1, filters=hdf5plugin.Blosc2.BITSHUFFLE))
