"""Columns of an HDF5 recording, as far as they can be read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import h5py

_UNREADABLE = (OSError, EOFError, RuntimeError, KeyError)
"""What h5py raises where a file has been damaged or truncated."""


INCOMPLETE = "fileobj"
"""The driver by which HDF5 reads a file that it would refuse; see ``incomplete_file.py``."""


class ReadableColumns:
    """The datasets of a file; of one that is truncated, their first rows.

    Parameters
    ----------
    file : h5py.File

    Attributes
    ----------
    complete : bool
        Whether every row that the file names is there.
    """

    def __init__(self, file: h5py.File) -> None:
        self._file = file
        # what HDF5 itself opens has every row that it names
        self.complete = file.driver != INCOMPLETE
        self._rows: dict[str, int] = {}

    def __contains__(self, name: str) -> bool:
        return self._dataset(name) is not None

    def rows(self, name: str) -> int:
        """Return how many rows from the first can be read; 0 if there is no such column."""
        if name not in self._rows:
            dataset = self._dataset(name)
            self._rows[name] = 0 if dataset is None else self._counted(dataset)
        return self._rows[name]

    def read(self, name: str, begin: int = 0, end: int | None = None) -> NDArray[Any]:
        """Read rows of a column that is there; all that can be read by default.

        Raises
        ------
        OSError
            Some of them cannot be read.
        """
        end = self.rows(name) if end is None else end
        try:
            values: NDArray[Any] = self._file[name][begin:end]
        except _UNREADABLE as error:
            raise OSError(str(error)) from error
        return values

    def lacks(self, name: str) -> bool:
        """Whether rows of a column cannot be read."""
        dataset = self._dataset(name)
        return dataset is None or self.rows(name) < len(dataset)

    def attributes(self, name: str) -> dict[str, Any]:
        """Return the attributes of a column that is there."""
        return dict(self._file[name].attrs)

    def is_compressed(self, name: str) -> bool:
        """Whether a column that is there is compressed."""
        dataset = self._dataset(name)
        return dataset is not None and dataset.id.get_create_plist().get_nfilters() > 0

    def inside(self, group: str) -> Iterator[str]:
        """Yield the names of the columns in a group and the groups in it, relative to it."""
        with suppress(*_UNREADABLE):
            for name in self._file[group or "/"]:
                if self._dataset(group + name) is not None:
                    yield name
                else:
                    yield from (f"{name}/{rest}" for rest in self.inside(f"{group}{name}/"))

    def _dataset(self, name: str) -> h5py.Dataset | None:
        with suppress(*_UNREADABLE):
            found = self._file.get(name)
            return found if hasattr(found, "shape") else None
        return None

    def _counted(self, dataset: h5py.Dataset) -> int:
        there = len(dataset)
        if self.complete or not there or _is_readable(dataset, there - 1):
            return there
        # rows are written one after another
        first, missing = 0, there - 1
        while first < missing:
            middle = (first + missing) // 2
            if _is_readable(dataset, middle):
                first = middle + 1
            else:
                missing = middle
        return first


def _is_readable(dataset: h5py.Dataset, row: int) -> bool:
    with suppress(*_UNREADABLE):
        np.asarray(dataset[row])
        return True
    return False
