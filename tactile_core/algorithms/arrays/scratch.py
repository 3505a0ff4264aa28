"""Reusable memory for intermediate images.

Allocating megabytes takes longer than many operations on them. So does memory other than that which
the previous step has left in the processor's cache.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tactile_core.algorithms.arrays.types import Array

_MOST_KEPT = 12
"""Blocks that a thread keeps; no step borrows as many at a time."""

_LARGEST_RATIO = 2
"""A block is reused only for arrays of at least half its size."""


class _Blocks(threading.local):
    """Free blocks of one thread, the last one used at the end."""

    def __init__(self) -> None:
        self.free: list[NDArray[np.uint8]] = []


_blocks = _Blocks()


@contextmanager
def borrowed(shape: tuple[int, ...], dtype: DTypeLike) -> Iterator[Array]:
    """Lend an uninitialised array until the end of the ``with`` block.

    Each thread has its own memory. A result must be neither the borrowed array nor a view of it.
    """
    dtype = np.dtype(dtype)
    size = math.prod(shape) * dtype.itemsize
    block = _taken(size)
    try:
        yield block[:size].view(dtype).reshape(shape)
    finally:
        _blocks.free.append(block)
        del _blocks.free[:-_MOST_KEPT]


def _taken(size: int) -> NDArray[np.uint8]:
    free = _blocks.free
    for index in reversed(range(len(free))):
        if size <= len(free[index]) <= _LARGEST_RATIO * size:
            return free.pop(index)
    return np.empty(size, np.uint8)
