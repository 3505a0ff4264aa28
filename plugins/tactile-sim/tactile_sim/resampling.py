"""Resampling from the nodes of the gel surface to the pixels of the image."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Float32, Float64
from tactile_core.algorithms.force.viscoelasticity import SurfaceGrid
from tactile_sim.normal_contact import Window
from tactile_sim.refinement import BandedMatrix

_HALF_STEPS = 24  # [count] At most, after the whole steps: each leaves half of the rest
# [node spacings] Iterations end when the position changes by less: a micrometre is five times as
# much on most grids
_TOLERANCE_NODES = 1e-4
# [ratio] A node whose influence on a coefficient is smaller is left out: an eighth of the precision
# of float32, which is 6e-8
_LEAST_INFLUENCE = 7e-9

# Whether OpenCV reads at any position; older versions round positions to 1/32 of a node.
_READS_BETWEEN = int(cv2.__version__.split(".")[0]) >= 5


class ImageSampler:
    """Resamples values on material nodes of the gel surface at the pixels of the image.

    Parameters
    ----------
    grid : SurfaceGrid
    shape : (height, width) in px
    mm_per_px : float

    Attributes
    ----------
    window : Window
        The nodes that the image needs; (my, mx) is its shape. The grid extends further, so that
        displacements do not wrap around.
    """

    def __init__(self, grid: SurfaceGrid, shape: tuple[int, int], mm_per_px: float) -> None:
        self.grid, self.shape, self.mm_per_px = grid, shape, mm_per_px
        y, x = (mm_per_px * np.arange(1 - n, n, 2) / 2 for n in shape)
        rows, columns = _find_needed_nodes(grid.y_mm, y), _find_needed_nodes(grid.x_mm, x)
        self.window = Window(rows, columns)
        self._along = (grid.y_mm[rows], y), (grid.x_mm[columns], x)
        self._known: tuple[Array, Float32] | None = None

    def _coefficients(self, displacement_mm: Array) -> Float32:
        """(3, ny + 2, nx + 2) coefficients of uniform cubic B-splines on all nodes.

        They are kept until another displacement is asked for.

        Parameters
        ----------
        displacement_mm : (3, ny, nx)
            x, y and indentation of each material node.
        """
        known = self._known  # another thread may replace it
        if known is None or known[0] is not displacement_mm:
            every_row, every_column = self._solutions
            moved = np.asarray(displacement_mm, np.float32)
            self._known = known = displacement_mm, every_row.times(every_column.along(moved))
        return known[1]

    def origins(self, displacement_mm: Array) -> Float32:
        """(2, my, mx) original row and column of the material that is now at each needed node.

        Parameters
        ----------
        displacement_mm : (2, ny, nx)
            x and y displacement of each material node.
        """
        row, column = self.window.view_of(np.indices(self.grid.shape, np.float32))
        moved = (displacement_mm / self.grid.spacing_mm).astype(np.float32)
        across, down = moved
        x, y = column - self.window.view_of(across), row - self.window.view_of(down)
        changes = np.full(x.shape, np.inf, np.float32)
        for _ in range(6):  # [count] enough for a strain of a fifth
            new_x, new_y = (
                at - cv2.remap(part, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
                for at, part in ((column, across), (row, down))
            )
            changes = np.maximum(abs(new_x - x), abs(new_y - y))
            x, y = new_x, new_y
            if _READS_BETWEEN and changes.max() < _TOLERANCE_NODES:
                break
        left = changes >= (_TOLERANCE_NODES if _READS_BETWEEN else 0)
        if left.any():
            x[left], y[left] = _find_origins(moved, (column[left], row[left]), (x[left], y[left]))
        return np.stack([y, x])

    def at_points(self, displacement_mm: Array, points_mm: NDArray[np.float64]) -> Float64:
        """(N, 2) displacement at material points (N, 2) of the surface, both x and y.

        Parameters
        ----------
        displacement_mm : (3, ny, nx)
            x, y and indentation of each material node.
        points_mm : (N, 2)
            On the undeformed surface.
        """
        first = np.array([self.grid.x_mm[0], self.grid.y_mm[0]])
        column, row = ((points_mm - first) / self.grid.spacing_mm).astype(np.float32).T
        return np.asarray(_cubic(self._coefficients(displacement_mm)[:2], row, column).T, float)

    def at_present(self, displacement_mm: Array, origins: Float32) -> Float32:
        """(3, my, mx) current displacement at the needed nodes, along x, y and z.

        Parameters
        ----------
        displacement_mm : (3, ny, nx)
            x, y and indentation of each material node.
        origins : (2, my, mx)
            Of :meth:`origins`.
        """
        return _cubic(self._coefficients(displacement_mm), *origins)

    def values(self, field: Array) -> Float32:
        """(H, W) values at the pixels, of a cubic spline through the needed nodes (my, mx)."""
        rows, columns = self._splines
        return rows.times(columns.along(np.asarray(field, np.float32)))

    @cached_property
    def _splines(self) -> tuple[BandedMatrix, BandedMatrix]:
        rows, columns = (BandedMatrix.from_matrix(spline_matrix(*side)) for side in self._along)
        return rows, columns

    @cached_property
    def _solutions(self) -> tuple[BandedMatrix, BandedMatrix]:
        """Matrices from values at all nodes to coefficients, along y and x."""
        rows, columns = (BandedMatrix.from_matrix(_solution(count)) for count in self.grid.shape)
        return rows, columns

    def mask(self, nodes: NDArray[np.bool_], places: Float32) -> NDArray[np.bool_]:
        """(H, W) current mask at the pixels, of a mask (ny, nx) that moved with the surface.

        Parameters
        ----------
        nodes : (ny, nx) bool
        places : (2, H, W) float32
            Original row and column of the material that is now at each pixel.
        """
        row, column = places
        return np.asarray(cv2.remap(nodes.astype(np.float32), column, row, cv2.INTER_LINEAR) > 0.5)


def _solution(count: int) -> Float32:
    """(n + 2, n) matrix from values at n nodes to the coefficients of uniform cubic B-splines."""
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(np.arange(count), np.eye(count), k=3)
    # the coefficient of a uniform cubic B-spline is the value minus a sixth of the curvature
    centres = np.arange(-1, count + 1)
    solution = spline(centres) - spline.derivative(2)(centres) / 6
    # the influence of distant nodes is below the precision of float32
    return np.where(abs(solution) < _LEAST_INFLUENCE, 0, solution).astype(np.float32)


def _weights(t: Array) -> tuple[Array, Array, Array, Array]:
    """Weights of the four uniform cubic B-splines that are non-zero at fractions t of cells."""
    s = 1 - t
    inner = [(4 + x * x * (3 * x - 6)) / 6 for x in (t, s)]
    return s * s * s / 6, inner[0], inner[1], t * t * t / 6


def _cells(places: Float32, size: int) -> tuple[NDArray[np.intp], Float32]:
    """Nodes before places on an axis of this many nodes, and the fractions of cells after them."""
    inside = np.clip(places, 0, size - 1)
    first = np.minimum(inside.astype(np.intp), size - 2)
    return first, inside - first.astype(np.float32)


def _linear(fields: Float32, x: Float32, y: Float32) -> Float32:
    """Fields (k, ny, nx) at places in nodes, linear between the nodes and constant beyond."""
    rows, columns = fields.shape[1:]
    (i, b), (j, a) = _cells(y, rows), _cells(x, columns)
    place = i * columns + j
    nw, ne, sw, se = (
        fields.reshape(len(fields), -1).take(place + k, 1) for k in (0, 1, columns, columns + 1)
    )
    above = nw + a * (ne - nw)
    return np.asarray(above + b * (sw + a * (se - sw) - above))


def _find_origins(
    moved: Float32, now: Sequence[Float32], places: Sequence[Float32]
) -> Sequence[Float32]:
    """Half steps from these places (x, y) to the origins of the material that is at others now."""
    for _ in range(_HALF_STEPS):
        steps = [
            at - here - old
            for at, here, old in zip(now, _linear(moved, *places), places, strict=True)
        ]
        places = [old + step / 2 for old, step in zip(places, steps, strict=True)]
        if max(abs(step).max() for step in steps) < _TOLERANCE_NODES:
            break
    return places


def _cubic(coefficients: Float32, row: Float32, column: Float32) -> Float32:
    """Cubic splines of coefficients (k, ny + 2, nx + 2) at places in nodes, constant beyond."""
    count, rows, columns = coefficients.shape
    (i, b), (j, a) = _cells(row, rows - 2), _cells(column, columns - 2)
    place, nodes = i * columns + j, coefficients.reshape(count, -1)
    total = np.zeros((count, *row.shape), np.float32)
    across = _weights(a)
    for down, weight in enumerate(_weights(b)):
        for k, w in enumerate(across):
            total += (weight * w) * nodes.take(place + (down * columns + k), 1)
    return total


def _find_needed_nodes(nodes: Array, targets: Array) -> slice:
    """Return the nodes that a spline at the targets depends on."""
    # [nodes] A node's influence on a cubic spline falls by 2 − √3 from node to node, to 1e-7
    margin = 12
    first, last = np.searchsorted(nodes, [targets[0], targets[-1]])
    return slice(max(0, int(first) - margin), min(len(nodes), int(last) + margin))


def spline_matrix(nodes: Array, targets: Array) -> Float32:
    """Matrix from values at the nodes to those of a cubic spline at the targets."""
    from scipy.interpolate import make_interp_spline

    matrix = make_interp_spline(nodes, np.eye(len(nodes)), k=3)(targets)
    return np.where(abs(matrix) < _LEAST_INFLUENCE, 0, matrix).astype(np.float32)
