"""Places of an image, x and y: where each pixel is, and which pixels points lie in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def from_middle(count: int) -> NDArray[np.float64]:
    """(n,) place of each of so many pixels in a line, from its middle."""
    return np.asarray(np.arange(count) - (count - 1) / 2)


def nodes(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """(h, w, 2) column and row of every pixel."""
    return np.indices(shape, np.float32)[::-1].transpose(1, 2, 0).copy()


def struck(points: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """(h, w) 1 at the pixels nearest to points (N, 2), which may lie outside; 0 elsewhere."""
    image = np.zeros(shape, np.uint8)
    at = np.rint(points).astype(np.intp)
    columns, rows = at[((at >= 0) & (at < shape[::-1])).all(axis=1)].T
    image[rows, columns] = 1
    return image
