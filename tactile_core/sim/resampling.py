"""From the nodes of the skin to the pixels of the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_core.sim.grid import Grid

Array = NDArray[np.floating]
Float32 = NDArray[np.float32]

_FIXED_POINT_STEPS = 6


class ImageSampler:
    """Values on nodes that moved with the skin, told at the pixels of the image.

    Parameters
    ----------
    grid : Grid
    shape : (height, width) in px
    mm_per_px : float
    """

    def __init__(self, grid: Grid, shape: tuple[int, int], mm_per_px: float) -> None:
        self.grid, self.shape, self.mm_per_px = grid, shape, mm_per_px
        y, x = ((np.arange(n) - (n - 1) / 2) * mm_per_px for n in shape)
        self._rows, self._row_slopes = _spline(grid.y_mm, y)
        self._columns, self._column_slopes = _spline(grid.x_mm, x)

    def origins(self, displacement_mm: Array) -> NDArray[np.float64]:
        """(2, ny, nx) at which row and column of nodes the skin was that is now at each node.

        Parameters
        ----------
        displacement_mm : (2, ny, nx)
            x and y of each node of the skin.
        """
        from scipy.ndimage import map_coordinates

        nodes = np.indices(self.grid.shape, float)
        moved = displacement_mm[::-1] / self.grid.spacing_mm
        found = nodes - moved
        for _ in range(_FIXED_POINT_STEPS):
            here = [map_coordinates(part, found, order=1, mode="nearest") for part in moved]
            found = nodes - np.stack(here)
        return found

    def at_present(self, fields: Array, origins: NDArray[np.float64]) -> Array:
        """(n, ny, nx) of values that moved with the skin: those that are now at the nodes."""
        from scipy.ndimage import map_coordinates

        return np.stack(
            [map_coordinates(field, origins, order=3, mode="nearest") for field in fields]
        )

    def now_at_nodes(
        self, mask: NDArray[np.bool_], origins: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(ny, nx) of a mask that moved with the skin: what is now at the nodes."""
        row, column = np.rint(origins).astype(int)
        last_row, last_column = mask.shape[0] - 1, mask.shape[1] - 1
        return mask[np.clip(row, 0, last_row), np.clip(column, 0, last_column)]

    def values(self, field: Array) -> Float32:
        """(H, W) cubic spline through the nodes' values."""
        return np.asarray(self._rows @ (np.asarray(field, np.float32) @ self._columns.T))

    def slopes(self, field: Array) -> tuple[Float32, Float32]:
        """Both (H, W): derivatives of :meth:`values` along x and y, per mm."""
        nodes = np.asarray(field, np.float32)
        along_x = self._rows @ (nodes @ self._column_slopes.T)
        along_y = self._row_slopes @ (nodes @ self._columns.T)
        return np.asarray(along_x), np.asarray(along_y)

    def mask(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(H, W): pixels nearer to nodes of the mask than to others."""
        import cv2

        height, width = self.shape
        scale = self.mm_per_px / self.grid.spacing_mm
        centre_x = (self.grid.nx - 1) / 2 - scale * (width - 1) / 2
        centre_y = (self.grid.ny - 1) / 2 - scale * (height - 1) / 2
        affine = np.array([[scale, 0, centre_x], [0, scale, centre_y]])
        share = cv2.warpAffine(
            nodes.astype(np.float32),
            affine,
            (width, height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        return np.asarray(share > 0.5)


def _spline(nodes: NDArray[np.float64], wanted: NDArray[np.float64]) -> tuple[Float32, Float32]:
    """Matrices from values at the nodes to a cubic spline's values and slopes elsewhere."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(nodes, np.eye(len(nodes)), k=3)
    return spline(wanted).astype(np.float32), spline.derivative()(wanted).astype(np.float32)
