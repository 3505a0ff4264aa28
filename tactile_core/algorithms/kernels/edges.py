"""What lies beyond the edge of an image, for other kernels."""

from __future__ import annotations

from numba import njit

from tactile_core.algorithms.kernels.options import PART


@njit(**PART)
def reflected(index: int, count: int) -> int:
    """Mirror an index outside a line about its last pixel, as OpenCV's filters do."""
    while count > 1 and (index < 0 or index >= count):
        index = -index if index < 0 else 2 * (count - 1) - index
    return index if count > 1 else 0
