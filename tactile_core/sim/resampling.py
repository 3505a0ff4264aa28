"""Resampling from the nodes of the gel surface to the pixels of the image."""

from __future__ import annotations

from functools import cached_property
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.sim.window import Window


class InversionParameters(NamedTuple):
    """Iterations that invert the displacement field. They bound the error, at a cost in time.

    Attributes
    ----------
    rough_steps : int, count
        Fixed-point iterations with OpenCV, which is fast and rounds positions to 1/32 node.
        Source: chosen by hand; no script derives it.
    exact_steps : int, count
        Further iterations in floating point.
        Source: chosen by hand; no script derives it.
    margin_nodes : int, nodes
        Nodes beyond the border of the image that the splines use.
        Source: the influence of a node on a cubic spline falls by 2 − √3 from node to node, so
        that of the next one is 1e-7.
    """

    rough_steps: int = 4
    exact_steps: int = 2
    margin_nodes: int = 12


INVERSION = InversionParameters()
"""The values in use."""


class ImageSampler:
    """Resamples values on material nodes of the gel surface at the pixels of the image.

    Parameters
    ----------
    grid : Grid
    shape : (height, width) in px
    mm_per_px : float

    Attributes
    ----------
    window : Window
        The nodes that the image needs; (my, mx) is its shape. The grid extends further, so that
        displacements do not wrap around.
    """

    def __init__(self, grid: Grid, shape: tuple[int, int], mm_per_px: float) -> None:
        self.grid, self.shape, self.mm_per_px = grid, shape, mm_per_px
        y, x = (mm_per_px * np.arange(1 - n, n, 2) / 2 for n in shape)
        rows, columns = _needed(grid.y_mm, y), _needed(grid.x_mm, x)
        self.window = Window(rows, columns)
        self._along = (grid.y_mm[rows], y), (grid.x_mm[columns], x)
        (self._rows, self._row_slopes), (self._columns, self._column_slopes) = (
            spline_matrices(nodes, targets) for nodes, targets in self._along
        )

    def origins(self, displacement_mm: Array) -> NDArray[np.float64]:
        """(2, my, mx) original row and column of the material that is now at each needed node.

        Parameters
        ----------
        displacement_mm : (2, ny, nx)
            x and y displacement of each material node.
        """
        import cv2
        from scipy.ndimage import map_coordinates

        row, column = self.window.of(np.indices(self.grid.shape, np.float32))
        across, down = (displacement_mm / self.grid.spacing_mm).astype(np.float32)
        x, y = column - self.window.of(across), row - self.window.of(down)
        for _ in range(INVERSION.rough_steps):
            here = [
                cv2.remap(part, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
                for part in (across, down)
            ]
            x, y = column - here[0], row - here[1]
        origins = np.stack([y, x]).astype(np.float64)
        for _ in range(INVERSION.exact_steps):
            moved = [
                map_coordinates(part, origins, order=1, mode="nearest") for part in (down, across)
            ]
            origins = np.stack([row - moved[0], column - moved[1]])
        return origins

    def at_points(self, fields: Array, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, K) values of fields (K, ny, nx) at material points (N, 2) of the surface."""
        from scipy.ndimage import map_coordinates

        if not len(points_mm):
            return np.zeros((0, len(fields)))
        first = np.array([self.grid.x_mm[0], self.grid.y_mm[0]])
        column, row = ((points_mm - first) / self.grid.spacing_mm).T
        values = [
            map_coordinates(field.astype(np.float64), [row, column], order=3, mode="nearest")
            for field in fields
        ]
        return np.stack(values, 1)

    def at_present(self, field: Array, origins: NDArray[np.float64]) -> Array:
        """(my, mx) current values at the needed nodes, of a field (ny, nx) that moved with them."""
        from scipy.ndimage import map_coordinates

        return np.asarray(map_coordinates(field, origins, order=3, mode="nearest"))

    def values(self, field: Array) -> Float32:
        """(H, W) values at the pixels, of a cubic spline through the needed nodes (my, mx)."""
        return np.asarray(self._rows @ (np.asarray(field, np.float32) @ self._columns.T))

    def slopes(self, field: Array) -> Float32:
        """(H, W, 2) derivatives of :meth:`values` along x and y, per mm."""
        nodes = np.asarray(field, np.float32)
        along = np.empty((2, *self.shape), np.float32)  # contiguous planes are faster to process
        np.matmul(self._rows, nodes @ self._column_slopes.T, out=along[0])
        np.matmul(self._row_slopes, nodes @ self._columns.T, out=along[1])
        return np.moveaxis(along, 0, 2)

    def seen(self, displacement_mm: Array, compiled: ModuleType) -> tuple[Float32, Float32]:
        """Return height and displacement at the pixels, by compiled loops.

        Parameters
        ----------
        displacement_mm : (3, ny, nx)
            x, y and indentation of each material node.
        compiled : module
            :mod:`tactile_core.sim.kernels.compiled`.

        Returns
        -------
        height_mm : (H, W) float32
        displacement_mm : (H, W, 2) float32
        """
        moved = np.ascontiguousarray(displacement_mm, np.float32)
        rows, columns = self._splines
        every_row, every_column = self._solutions
        now = np.empty((3, *self.window.shape), np.float32)
        compiled.at_present(
            moved[:2] / np.float32(self.grid.spacing_mm),
            every_row @ moved @ every_column.T,
            (self.window.rows.start, self.window.columns.start),
            now,
        )
        images = np.empty((3, *self.shape), np.float32)
        for coefficients, image in zip(
            rows.solution @ now @ columns.solution.T, images, strict=True
        ):
            compiled.values(coefficients, rows.tables, columns.tables, image)
        return images[2], np.moveaxis(images[:2], 0, 2)

    @cached_property
    def _splines(self) -> tuple[_BSplines, _BSplines]:
        rows, columns = self._along
        return _BSplines.of(*rows), _BSplines.of(*columns)

    @cached_property
    def _solutions(self) -> tuple[Float32, Float32]:
        """Matrices from values at all nodes to coefficients, along y and x."""
        return _solution(self.grid.ny), _solution(self.grid.nx)

    def mask(self, nodes: NDArray[np.bool_], places: Float32) -> NDArray[np.bool_]:
        """(H, W) current mask at the pixels, of a mask (ny, nx) that moved with the surface.

        Parameters
        ----------
        nodes : (ny, nx) bool
        places : (2, H, W) float32
            Original row and column of the material that is now at each pixel.
        """
        import cv2

        row, column = places
        return np.asarray(cv2.remap(nodes.astype(np.float32), column, row, cv2.INTER_LINEAR) > 0.5)


class _BSplines(NamedTuple):
    """The spline of :func:`spline_matrices` as a sum of uniform cubic B-splines, one per node.

    Attributes
    ----------
    solution : (n + 2, n) float32
        Matrix from values at the nodes to coefficients.
    tables : (N,) int64 and (4, N) float32
        For each target position, the index of the first of its four coefficients, and their
        weights.
    """

    solution: Float32
    tables: tuple[NDArray[np.int64], Float32]

    @classmethod
    def of(cls, nodes: Array, targets: Array) -> _BSplines:
        from scipy.interpolate import BSpline

        count = len(nodes)
        position = (targets - nodes[0]) / (nodes[1] - nodes[0])
        weights = BSpline.design_matrix(position, np.arange(-3.0, count + 3), 3, extrapolate=True)
        first = weights.indices.reshape(-1, 4)[:, 0].astype(np.int64)
        four = np.ascontiguousarray(weights.data.reshape(-1, 4).T, np.float32)
        return cls(_solution(count), (first, four))


def _solution(count: int) -> Float32:
    """(n + 2, n) matrix from values at n nodes to the coefficients of uniform cubic B-splines."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(np.arange(count), np.eye(count), k=3)
    # the coefficient of a uniform cubic B-spline is the value minus a sixth of the curvature
    centres = np.arange(-1, count + 1)
    return np.asarray(spline(centres) - spline.derivative(2)(centres) / 6, np.float32)


def _needed(nodes: Array, targets: Array) -> slice:
    """Return the nodes that a spline at the targets depends on."""
    margin = INVERSION.margin_nodes
    first, last = np.searchsorted(nodes, [targets[0], targets[-1]])
    return slice(max(0, int(first) - margin), min(len(nodes), int(last) + margin))


def spline_matrices(nodes: Array, targets: Array) -> tuple[Float32, Float32]:
    """Matrices from values at the nodes to a cubic spline's values and slopes at the targets."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(nodes, np.eye(len(nodes)), k=3)
    return spline(targets).astype(np.float32), spline.derivative()(targets).astype(np.float32)
