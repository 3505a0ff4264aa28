"""The part of the grid in which an object touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array

_MARGIN_NODES, _MARGIN_SHARE = 2, 0.1
_MULTIPLE = 8
"""Sizes go in steps, so that a contact that grows a little finds its response ready."""


@dataclass(frozen=True)
class Window:
    """Some rows and columns of a grid.

    Attributes
    ----------
    rows, columns : slice
        With both ends.
    """

    rows: slice
    columns: slice

    @classmethod
    def around(cls, nodes: NDArray[np.bool_]) -> Window:
        """Return a window that holds these nodes, of which there is one at least, and a margin."""
        return cls(_wide(np.asarray(nodes.any(1))), _wide(np.asarray(nodes.any(0))))

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start

    def of(self, field: Array) -> Array:
        """Return a view of the window's part of an array whose last axes are the grid's."""
        return field[..., self.rows, self.columns]

    def holds(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether all of these nodes are inside."""
        return bool(np.count_nonzero(nodes) == np.count_nonzero(self.of(nodes)))

    def reaches_its_border(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether nodes of the window are next to others of the grid, beside the window.

        Parameters
        ----------
        nodes : (ny, nx)
            Of the grid.
        """
        inside = self.of(nodes)
        (top, bottom), (left, right) = (
            (part.start > 0, part.stop < size)
            for part, size in zip((self.rows, self.columns), nodes.shape, strict=True)
        )
        return bool(
            (top and inside[0].any())
            or (bottom and inside[-1].any())
            or (left and inside[:, 0].any())
            or (right and inside[:, -1].any())
        )

    def spread_out(self, part: Array, shape: tuple[int, int]) -> Array:
        """Return an array of the whole grid that is zero outside of the window."""
        whole = np.zeros((*part.shape[:-2], *shape), part.dtype)
        self.of(whole)[...] = part
        return whole


def _wide(taken: NDArray[np.bool_]) -> slice:
    first = int(taken.argmax())
    last = len(taken) - int(taken[::-1].argmax())
    margin = _MARGIN_NODES + int(_MARGIN_SHARE * (last - first))
    size = -(-(last - first + 2 * margin) // _MULTIPLE) * _MULTIPLE
    if 2 * size >= len(taken):
        return slice(0, len(taken))
    start = min(max((first + last - size) // 2, 0), len(taken) - size)
    return slice(start, start + size)
