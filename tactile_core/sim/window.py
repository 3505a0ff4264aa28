"""Window of the grid around a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array


class WINDOW:
    """Size of a window around a contact. It affects the time of a step, not its solution."""

    margin_nodes = 2  # [nodes] Margin on each side of the contact
    margin_share = 0.1  # [share of the contact's size] Further margin on each side
    # [nodes] Window sizes are multiples of this, so that a contact that grows slightly reuses the
    # response of the last step.
    multiple = 8


@dataclass(frozen=True)
class Window:
    """Contiguous rows and columns of a grid.

    Attributes
    ----------
    rows, columns : slice
        Both have explicit start and stop.
    """

    rows: slice
    columns: slice

    @classmethod
    def around(cls, nodes: NDArray[np.bool_]) -> Window:
        """Return a window that contains these nodes (at least one) and a margin."""
        return cls(_wide(np.asarray(nodes.any(1))), _wide(np.asarray(nodes.any(0))))

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.rows.stop - self.rows.start, self.columns.stop - self.columns.start

    def view_of(self, field: Array) -> Array:
        """Return a view of the window in an array whose last two axes are the grid's."""
        return field[..., self.rows, self.columns]

    def contains(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether all of these nodes are inside."""
        return bool(np.count_nonzero(nodes) == np.count_nonzero(self.view_of(nodes)))

    def reaches_its_border(self, nodes: NDArray[np.bool_]) -> bool:
        """Whether any of these nodes is on a border of the window that is inside the grid.

        Parameters
        ----------
        nodes : (ny, nx)
            Mask on the whole grid.
        """
        inside = self.view_of(nodes)
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

    def embed_part(self, part: Array, shape: tuple[int, int]) -> Array:
        """Embed a part in an array of the whole grid that is zero outside the window."""
        whole = np.zeros((*part.shape[:-2], *shape), part.dtype)
        self.view_of(whole)[...] = part
        return whole


def _wide(taken: NDArray[np.bool_]) -> slice:
    first = int(taken.argmax())
    last = len(taken) - int(taken[::-1].argmax())
    margin = WINDOW.margin_nodes + int(WINDOW.margin_share * (last - first))
    size = -(-(last - first + 2 * margin) // WINDOW.multiple) * WINDOW.multiple
    if 2 * size >= len(taken):
        return slice(0, len(taken))
    start = min(max((first + last - size) // 2, 0), len(taken) - size)
    return slice(start, start + size)
