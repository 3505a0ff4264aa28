"""The grid on which a field is computed before it is enlarged to the image."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import nodes
from tactile_core.algorithms.arrays.shrinking import enlarged, repeated, shrunk
from tactile_core.algorithms.arrays.types import Array, Float32

_MOST_NODES = 64


@dataclass(frozen=True)
class CoarseGrid:
    """Nodes in the middle of cells of equal size that tile the image.

    Attributes
    ----------
    shape : (rows, columns) of nodes
    image_shape : (H, W) in px
    """

    shape: tuple[int, int]
    image_shape: tuple[int, int]

    @classmethod
    def of(cls, image_shape: tuple[int, int], cell_px: float) -> CoarseGrid:
        """Return the grid with cells of about this size, but not more than 64 along a side."""
        cell = max(cell_px, max(image_shape) / _MOST_NODES)
        rows, columns = (max(2, round(side / cell)) for side in image_shape)
        return cls((rows, columns), image_shape)

    @property
    def cell_px(self) -> NDArray[np.float64]:
        """(2,) width and height of a cell."""
        return np.asarray(np.divide(self.image_shape[::-1], self.shape[::-1]), np.float64)

    @property
    def nodes(self) -> Float32:
        """(rows, columns, 2) column and row of every node, in cells."""
        return nodes(self.shape)

    @property
    def half(self) -> CoarseGrid:
        """The grid with half as many nodes along each side."""
        rows, columns = (max(2, count // 2) for count in self.shape)
        return CoarseGrid((rows, columns), self.image_shape)

    def in_cells(self, points_px: Array) -> Float32:
        """(…, 2) column and row of points x, y in the image."""
        return np.asarray((points_px + 0.5) / self.cell_px - 0.5, np.float32)

    def in_px(self, points: Array) -> NDArray[np.float64]:
        """(…, 2) x and y in the image of points that are told in cells."""
        return np.asarray((points + 0.5) * self.cell_px - 0.5)

    def sampled(self, field: Float32, points: Float32) -> Float32:
        """Values of a field (rows, columns, 2) at points (…, 2) in cells, linear between nodes."""
        found = cv2.remap(
            field, points, np.empty(0), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(found, np.float32)

    def share(self, mask: NDArray[np.bool_]) -> Float32:
        """(rows, columns) how much of each cell is inside a mask (H, W)."""
        rows, columns = self.shape
        small = shrunk(np.negative(mask.view(np.uint8)), (columns, rows))
        return small.astype(np.float32) / np.float32(255)

    def marked(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(H, W) of cells (rows, columns)."""
        return repeated(cells.view(np.uint8), self.image_shape).view(np.bool_)

    def refined(self, field: Float32) -> Float32:
        """(rows, columns, 2) of a field on the half grid, by cubics."""
        size = self.shape[::-1]
        return np.asarray(cv2.resize(field, size, interpolation=cv2.INTER_CUBIC), np.float32)

    def enlarged(self, field: Float32) -> Float32:
        """(H, W, 2) of a field (rows, columns, 2)."""
        return enlarged(field, self.image_shape)
