"""Rows of a data set, kept in a file until all shapes are known."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

from numpy.typing import NDArray


class Picture(NamedTuple):
    """An image file, and what the statistics need of it.

    Attributes
    ----------
    content : bytes
        A JPEG as the camera sent it, or a PNG.
    name : str
    values : (n, channels) array
        0..1.
    """

    content: bytes
    name: str
    values: NDArray[Any]


class Row(NamedTuple):
    """One observation.

    Attributes
    ----------
    pictures : dict of str to Picture
    arrays : dict of str to array
    """

    pictures: dict[str, Picture]
    arrays: dict[str, NDArray[Any]]


class RowFile:
    """Appends rows to a temporary file, so that memory stays flat."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] = path.open("xb")

    def append(self, row: Row) -> None:
        """Append a row."""
        pickle.dump(row, self._file, protocol=pickle.HIGHEST_PROTOCOL)

    def close(self) -> None:
        """Close and remove the file."""
        self._file.close()
        self._path.unlink(missing_ok=True)

    def __iter__(self) -> Iterator[Row]:
        """Read the rows from the start."""
        self._file.flush()
        with self._path.open("rb") as file:
            while True:
                try:
                    row: Row = pickle.load(file)  # this process wrote it
                except EOFError:
                    return
                yield row
