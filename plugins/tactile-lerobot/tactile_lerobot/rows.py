"""Rows of a data set, and their statistics."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
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


# Names and values of the quantiles.
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


class Statistics:
    """Minimum, maximum, mean, standard deviation and quantiles of each component.

    Parameters
    ----------
    shape : tuple of int
        Shape of the result, which is one value for each component.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape
        self._rows = 0
        self._count: NDArray[Any] = np.zeros(0)
        self._samples: list[NDArray[np.float64]] = []

    def add(self, values: NDArray[Any]) -> None:
        """Add the (n, components) values of one row; NaN is left out."""
        values = np.asarray(values, np.float64)
        known = np.isfinite(values)
        zeroed = np.where(known, values, 0)
        lowest = np.where(known, values, np.inf).min(axis=0)
        highest = np.where(known, values, -np.inf).max(axis=0)
        parts = known.sum(axis=0), zeroed.sum(axis=0), (zeroed**2).sum(axis=0), lowest, highest
        if self._rows == 0:
            self._count, self._sum, self._squares, self._lowest, self._highest = parts
        else:
            self._count = self._count + parts[0]
            self._sum = self._sum + parts[1]
            self._squares = self._squares + parts[2]
            self._lowest = np.minimum(self._lowest, lowest)
            self._highest = np.maximum(self._highest, highest)
        self._rows += 1
        self._samples.append(values[:: max(1, len(values) // 512)])  # [count]

    def result(self) -> dict[str, Any]:
        """Return JSON-ready lists; 0 where nothing is known."""
        count = np.maximum(self._count, 1)
        mean = self._sum / count
        spread = np.sqrt(np.maximum(self._squares / count - mean**2, 0))
        found = {"min": self._lowest, "max": self._highest, "mean": mean, "std": spread}
        samples = np.concatenate(self._samples)
        samples = np.where(np.isfinite(samples), samples, mean)
        for name, share in QUANTILES.items():
            found[name] = np.quantile(samples, share, axis=0)
        lists = {
            name: np.where(np.isfinite(values), values, 0).reshape(self._shape).tolist()
            for name, values in found.items()
        }
        return {**lists, "count": [self._rows]}


def components(value: NDArray[Any]) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Return a row's values as (n, components), and the shape of their statistics.

    A vector has as many components as elements, an array of more axes just one.
    """
    if value.ndim <= 1:
        flat = value.reshape(1, -1)
        return flat, (flat.shape[1],)
    return value.reshape(-1, 1), (1,) * value.ndim


def image_components(pixels: NDArray[Any]) -> tuple[NDArray[Any], tuple[int, ...]]:
    """Return the values 0..1 of an image of 8 bits as (n, channels), and their shape."""
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    # a sparse grid of pixels is enough, and as fast as the rest of a row
    some = pixels[::4, ::4] if min(pixels.shape[:2]) > 64 else pixels
    return some.reshape(-1, channels) / 255, (channels, 1, 1)
