"""The coarse grid on which a displacement field is computed before it is interpolated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.places import nodes
from tactile_core.algorithms.arrays.shrinking import enlarged, repeated, shrunk
from tactile_core.algorithms.arrays.types import Array, Float32

MOST_COUNTED = 255  # As many rows of a mask as a byte counts


class GRID:
    """Parameters of the coarse grid."""

    # [count] Nodes along the longer side of the image, which bound the time of a frame. Source:
    # by hand, for speed.
    max_nodes = 64


@dataclass(frozen=True)
class CoarseGrid:
    """A grid of equal cells that tile the image, with a node at the centre of each.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns of nodes.
    image_shape : (int, int)
        H and W of the image, px.
    """

    shape: tuple[int, int]
    image_shape: tuple[int, int]

    @classmethod
    def of(cls, image_shape: tuple[int, int], cell_px: float) -> CoarseGrid:
        """Return a grid with cells of about this size, and at most 64 along a side."""
        cell = max(cell_px, max(image_shape) / GRID.max_nodes)
        rows, columns = (max(2, round(side / cell)) for side in image_shape)
        return cls((rows, columns), image_shape)

    @cached_property
    def cell_px(self) -> NDArray[np.float64]:
        """(2,) width and height of a cell, px."""
        return np.asarray(np.divide(self.image_shape[::-1], self.shape[::-1]), np.float64)

    @property
    def nodes(self) -> Float32:
        """(rows, columns, 2) column and row of each node, in cells."""
        return nodes(self.shape)

    @property
    def half(self) -> CoarseGrid:
        """The grid with half as many nodes along each side."""
        rows, columns = (max(2, count // 2) for count in self.shape)
        return CoarseGrid((rows, columns), self.image_shape)

    def in_cells(self, points_px: Array) -> Float32:
        """Convert points (…, 2) from pixels, x and y, to cells, column and row."""
        return np.asarray((points_px + 0.5) / self.cell_px - 0.5, np.float32)

    def in_px(self, points: Array) -> NDArray[np.float64]:
        """Convert points (…, 2) from cells, column and row, to pixels, x and y."""
        return np.asarray((points + 0.5) * self.cell_px - 0.5)

    def sampled(self, planes: Float32, points: Float32) -> Float32:
        """Interpolate planes (K, rows, columns) linearly at points (N, 2) in cells, (K, N)."""
        x, y = np.ascontiguousarray(points.T)[:, None]
        how, border = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
        # one by one, because OpenCV rounds the places of two channels to 1/32 of a cell
        found = [cv2.remap(plane, x, y, how, borderMode=border) for plane in planes]
        return np.concatenate(found)

    def share(self, mask: NDArray[np.bool_]) -> Float32:
        """Share (rows, columns) of each cell that a mask (H, W) covers."""
        (rows, columns), (height, width) = self.shape, self.image_shape
        if height % rows == width % columns == 0 and height // rows <= MOST_COUNTED:
            # eight pixels at once
            whole = np.uint64 if width % 8 == 0 else np.uint8
            lines = mask.view(whole).reshape(rows, height // rows, -1)
            counts = np.add.reduce(lines, axis=1, dtype=whole).view(np.uint8)
            cells = counts.reshape(rows * columns, -1).astype(np.float32)
            total = cells @ np.ones(cells.shape[1], np.float32)
            pixels = np.float32(height // rows * cells.shape[1])
            return np.asarray(total.reshape(self.shape) / pixels, np.float32)
        small = shrunk(np.negative(mask.view(np.uint8)), (columns, rows))
        return small.astype(np.float32) / np.float32(255)

    def marked(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Repeat a mask of cells (rows, columns) to the image (H, W)."""
        return repeated(cells.view(np.uint8), self.image_shape).view(np.bool_)

    @cached_property
    def refinement(self) -> tuple[Float32, Float32]:
        """Weights of cubic interpolation from the :attr:`half` grid.

        (rows, rows of the half grid) and (columns of the half grid, columns) float32.
        """
        along_y, along_x = (
            cv2.resize(np.eye(few, dtype=np.float32), (few, many), interpolation=cv2.INTER_CUBIC)
            for few, many in zip(self.half.shape, self.shape, strict=True)
        )
        return np.asarray(along_y, np.float32), np.ascontiguousarray(along_x.T, np.float32)

    def refined(self, planes: Float32) -> Float32:
        """Interpolate planes (K, …) on the :attr:`half` grid to (K, rows, columns), with cubics."""
        along_y, along_x = self.refinement
        return np.asarray(along_y @ planes @ along_x)

    def enlarged(self, field: Float32) -> Float32:
        """Interpolate a field (rows, columns, 2) linearly to the image (H, W, 2)."""
        return enlarged(field, self.image_shape)
