"""Memory for intermediate images, lent again and again.

Fresh megabytes cost more than much of the work on them, and so do others than those that the step
before has just left in the processor's cache.
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
"""Blocks that a thread keeps: more than any step borrows at a time."""

_ROOMIEST = 2
"""A block is not lent to arrays smaller than its half."""


class _Blocks(threading.local):
    """The blocks of one thread that nobody uses, the one last used at the end."""

    def __init__(self) -> None:
        self.free: list[NDArray[np.uint8]] = []


_blocks = _Blocks()


@contextmanager
def borrowed(shape: tuple[int, ...], dtype: DTypeLike) -> Iterator[Array]:
    """Lend an array, whatever it holds, until the end of the ``with`` block.

    Each thread has its own memory. No result may be, or be a view of, what is borrowed.
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
        if size <= len(free[index]) <= _ROOMIEST * size:
            return free.pop(index)
    return np.empty(size, np.uint8)
