"""Reusable memory for intermediate images.

Allocating megabytes takes longer than many operations on them. So does memory other than that which
the previous step has left in the processor's cache.
"""

from __future__ import annotations

import math
import threading
from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.arrays.types import Array

_MOST_KEPT = 12  # Blocks that a thread keeps; no step borrows as many at a time

_LARGEST_RATIO = 2  # A block is reused only for arrays of at least half its size


class _Blocks(threading.local):
    """Free blocks of one thread, the last one used at the end."""

    def __init__(self) -> None:
        self.free: list[NDArray[np.uint8]] = []


_blocks = _Blocks()


def borrowed(shape: tuple[int, ...], dtype: DTypeLike) -> AbstractContextManager[Array]:
    """Lend an uninitialised array until the end of the ``with`` block.

    Each thread has its own memory. A result must be neither the borrowed array nor a view of it.
    """
    return _Loan(shape, np.dtype(dtype))


class _Loan:
    """The context manager of :func:`borrowed`; one from a generator takes twice as long."""

    __slots__ = ("_block", "_dtype", "_shape")

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self._shape, self._dtype = shape, dtype

    def __enter__(self) -> Array:
        size = math.prod(self._shape) * self._dtype.itemsize
        self._block = _taken(size)
        return self._block[:size].view(self._dtype).reshape(self._shape)

    def __exit__(self, *_: object) -> None:
        _blocks.free.append(self._block)
        del _blocks.free[:-_MOST_KEPT]


def _taken(size: int) -> NDArray[np.uint8]:
    free = _blocks.free
    for index in reversed(range(len(free))):
        if size <= len(free[index]) <= _LARGEST_RATIO * size:
            return free.pop(index)
    return np.empty(size, np.uint8)
