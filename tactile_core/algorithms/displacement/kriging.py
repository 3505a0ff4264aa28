"""Kriging between markers, on a coarse grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.shrinking import enlarge_cells, repeat_pixels, shrink_image
from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, nodes

# [ratio] Variance of a constant and of a linear trend of the field, per range. Source: by
# hand, large compared with 1, so that trends are not damped.
_SHIFT_VARIANCE = 1e2
_SLOPE_VARIANCE = 1e1


class Kriging:
    """Interpolate values at markers, with a Matérn covariance (ν = 3/2) and a linear trend.

    The weights depend only on the positions of the markers. An unseen marker gets the most likely
    value given the others, and the result is exactly that of the seen markers alone.

    Parameters
    ----------
    markers_mm : (N, 2) float
        Positions of the markers.
    points_mm : (rows, columns, 2) float
        Positions at which the field is interpolated, M of them.
    range_mm : float
        Length scale of the covariance.
    pitch_mm : float
        Distance of neighbouring markers.

    References
    ----------
    .. [1] C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning", MIT
       Press, 2006, sections 4.2.1 (covariance), 2.2 (variance) and 5.4.2 (leave-one-out).
    """

    def __init__(
        self, markers_mm: Array, points_mm: Array, *, range_mm: float, pitch_mm: float
    ) -> None:
        markers, points = (
            np.array(at, np.float64).reshape(-1, 2) / range_mm for at in (markers_mm, points_mm)
        )
        middle = points.mean(axis=0)
        markers, points = markers - middle, points - middle
        # [ratio] 0.1 px of 28 µm, relative to a field of 0.16 mm
        noise = 3e-4 * np.eye(len(markers))
        covariance: Float64 = _covariance(markers, markers) + noise
        self._precision = np.asarray(np.linalg.inv(covariance), np.float64)
        between = _covariance(points, markers)
        weights = between @ self._precision
        # in float32, because these matrices are read whole in every frame
        self._weights: Float32 = np.ascontiguousarray(weights.T, np.float32)
        unexplained = _variance(points) - (weights * between).sum(axis=1)
        near = _nearness(points, markers, pitch_mm / range_mm)
        variances = (near * np.maximum(unexplained, 0)[:, None]).astype(np.float32)
        rows, columns = points_mm.shape[:2]
        self.std_shape = max(1, rows // 2), max(1, columns // 2)
        shares = (
            shrink_image(np.eye(many, dtype=np.float32), (many, few))
            for many, few in zip((rows, columns), self.std_shape, strict=True)
        )
        means = np.kron(*shares) @ variances
        self._variances: Float32 = np.ascontiguousarray(means, np.float32)
        # [ratio] The residuals have heavy tails, so that it is below 1
        # (``benchmarks/uncertainty.py``, on virtual contacts)
        self._variance_shares = 0.75**2 / (2 * self._precision.diagonal())

    def complete_values(self, values: Float64, seen: Bool) -> Float64:
        """Replace the values of unseen markers by the most likely ones, given the others.

        Parameters
        ----------
        values : (N, J) float64
            J fields.
        seen : (N,) bool

        Returns
        -------
        (N, J) float64
        """
        if np.count_nonzero(seen) == len(seen):
            return values
        unseen = np.flatnonzero(~seen)
        completed = np.where(seen[:, None], values, 0.0)
        rows = self._precision[unseen]
        completed[unseen] = -np.linalg.solve(rows[:, unseen], rows @ completed)
        return completed

    def weight_values(self, values: Float64) -> Float64:
        """Multiply completed values (N, J) by the inverse covariance."""
        return np.asarray(self._precision @ values)

    def field(self, values: Float64) -> Float32:
        """Interpolate completed values (N, J) at the points, (J, M)."""
        return np.asarray(values.T.astype(np.float32) @ self._weights)

    def std(self, weighted: Float64) -> Float32:
        """Estimate the standard deviation of a component of :meth:`field`, in blocks of points.

        The scale of the posterior variance is that of the leave-one-out residuals nearby; the
        variance is averaged over 2 × 2 points.

        Parameters
        ----------
        weighted : (N, J) float64
            The values, from :meth:`weight_values`.

        Returns
        -------
        :attr:`std_shape` float32
        """
        squared = np.einsum("ij,ij->i", weighted, weighted) * self._variance_shares
        variance = self._variances @ squared.astype(np.float32)
        return np.asarray(np.sqrt(variance).reshape(self.std_shape))


def _covariance(a: Float64, b: Float64) -> Float64:
    from scipy.spatial.distance import cdist

    far = np.sqrt(3) * cdist(a, b)
    trend = _SLOPE_VARIANCE * (a @ b.T)
    return np.asarray((1 + far) * np.exp(-far) + _SHIFT_VARIANCE + trend, np.float64)


def _variance(points: Float64) -> Float64:
    """Diagonal of the covariance of points, (M,)."""
    trend = _SLOPE_VARIANCE * (points**2).sum(axis=1)
    return np.asarray(1 + _SHIFT_VARIANCE + trend, np.float64)


def _nearness(points: Float64, markers: Float64, distance: float) -> Float64:
    """Weights (M, N) of the markers near each point, which add up to 1."""
    from scipy.spatial.distance import cdist

    squared = cdist(points, markers, "sqeuclidean") / distance**2
    nearest = squared.min(axis=1, keepdims=True, initial=np.inf)
    near = np.exp((nearest - squared) / 2)
    return np.asarray(near / near.sum(axis=1, keepdims=True), np.float64)


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
    def for_image(cls, image_shape: tuple[int, int], cell_px: float) -> CoarseGrid:
        """Return a grid with cells of about this size, and at most 64 along a side."""
        cell = max(cell_px, max(image_shape) / 64)  # [nodes] for speed
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

    def sample_planes(self, planes: Float32, points: Float32) -> Float32:
        """Interpolate planes (K, rows, columns) linearly at points (N, 2) in cells, (K, N)."""
        x, y = np.ascontiguousarray(points.T)[:, None]
        how, border = cv2.INTER_LINEAR, cv2.BORDER_REPLICATE
        # one by one, because OpenCV rounds the places of two channels to 1/32 of a cell
        found = [cv2.remap(plane, x, y, how, borderMode=border) for plane in planes]
        return np.concatenate(found)

    def share(self, mask: NDArray[np.bool_]) -> Float32:
        """Share (rows, columns) of each cell that a mask (H, W) covers."""
        (rows, columns), (height, width) = self.shape, self.image_shape
        # A byte counts no further
        if height % rows == width % columns == 0 and height // rows <= 255:
            # eight pixels at once
            whole = np.uint64 if width % 8 == 0 else np.uint8
            lines = mask.view(whole).reshape(rows, height // rows, -1)
            counts = np.add.reduce(lines, axis=1, dtype=whole).view(np.uint8)
            cells = counts.reshape(rows * columns, -1).astype(np.float32)
            total = cells @ np.ones(cells.shape[1], np.float32)
            pixels = np.float32(height // rows * cells.shape[1])
            return np.asarray(total.reshape(self.shape) / pixels, np.float32)
        small = shrink_image(np.negative(mask.view(np.uint8)), (columns, rows))
        return small.astype(np.float32) / np.float32(255)

    def enlarge_mask(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Repeat a mask of cells (rows, columns) to the image (H, W)."""
        return repeat_pixels(cells.view(np.uint8), self.image_shape).view(np.bool_)

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

    def refine_planes(self, planes: Float32) -> Float32:
        """Interpolate planes (K, …) on the :attr:`half` grid to (K, rows, columns), with cubics."""
        along_y, along_x = self.refinement
        return np.asarray(along_y @ planes @ along_x)

    def enlarge_field(self, field: Float32) -> Float32:
        """Interpolate a field (rows, columns, 2) linearly to the image (H, W, 2)."""
        return enlarge_cells(field, self.image_shape)
