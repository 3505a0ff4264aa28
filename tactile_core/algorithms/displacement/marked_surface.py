"""The dense displacement field of a gel surface whose markers are tracked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import (
    Array,
    Bool,
    Float32,
    Float64,
    pitch,
    rasterise_points,
)
from tactile_core.algorithms.displacement.contact_shear import ElasticShear
from tactile_core.algorithms.displacement.kriging import CoarseGrid, Kriging
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, THICKNESS_MM, Elastomer
from tactile_core.errors import InputError

_TINY = float(np.finfo(np.float32).tiny)


# [gel thicknesses] Length scale of the covariance of the interpolated part: chosen on virtual gels
# (ADR 27)
_RANGE_THICKNESSES = 6.0
_CELLS_PER_PITCH = 4.0  # [count] Resolution of the coarse grid: for speed
# [pitches] The field is valid within this distance of a marker that is seen: the distance to the
# next marker; beyond it the field is extrapolated
_SUPPORT_PITCHES = 1.0


@dataclass(frozen=True, eq=False)
class CoarseField:
    """A displacement field and its standard deviation, each in cells that tile the image.

    Attributes
    ----------
    cells_mm : (rows, columns, 2) float32
        +x right, +y down.
    std : callable
        Computes :attr:`std_cells_mm`.
    """

    cells_mm: Float32
    std: Callable[[], Float32]

    @cached_property
    def std_cells_mm(self) -> Float32:
        """(rows, columns) standard deviation of a component, on a grid of its own."""
        return self.std()


class MarkedSurface:
    """Interpolate the displacements of markers to every pixel.

    Four elastic fields of the contact (:class:`ElasticShear`) are fitted to the displacements of
    the markers, and the residual is interpolated (:class:`Kriging`). Their sum is then moved from
    undeformed to present positions. Everything that depends only on the reference is computed once.

    Parameters
    ----------
    reference_px : (N, 2) float
        Position of each marker on the undeformed gel surface, x and y.
    shape : (H, W)
        Shape of the image.
    mm_per_px : float
        Scale of the image.
    thickness_mm, poisson_ratio : float
        Thickness and Poisson's ratio of the gel.

    Raises
    ------
    InputError
        The markers are not (N, 2).

    References
    ----------
    .. [1] C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning", MIT
       Press, 2006, section 2.7: explicit basis functions.
    """

    def __init__(
        self,
        reference_px: Array,
        shape: tuple[int, int],
        *,
        mm_per_px: float,
        thickness_mm: float = THICKNESS_MM,
        poisson_ratio: float = POISSON_RATIO,
    ) -> None:
        if reference_px.ndim != 2 or reference_px.shape[1] != 2:
            raise InputError(f"markers are (N, 2); these are {reference_px.shape}")
        self.reference_px = np.array(reference_px, np.float64)
        self._pitch_px = pitch(self.reference_px)
        self._mm_per_px = mm_per_px
        self._grid = grid = CoarseGrid.for_image(shape, self._pitch_px / _CELLS_PER_PITCH)
        per_mm = 1 / (mm_per_px * grid.cell_px)
        reach_px = min(_SUPPORT_PITCHES * self._pitch_px, max(shape))
        across, down = (2 * max(1, round(reach_px / side)) + 1 for side in grid.cell_px)
        self._around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, down))
        # the residual varies over a pitch, so that two nodes per pitch are enough
        half = grid.half
        half_px = half.in_px(half.nodes)
        self._half_shape = half.shape
        # tiled to every node, because broadcasting along an axis of two is slow
        self._half_nodes = np.ascontiguousarray(grid.in_cells(half_px).reshape(-1, 2).T)
        self._per_mm = np.tile(per_mm.astype(np.float32)[:, None], self._half_nodes.shape[1])
        self._kriging = Kriging(
            self.reference_px * mm_per_px,
            half_px * mm_per_px,
            range_mm=_RANGE_THICKNESSES * thickness_mm,
            pitch_mm=self._pitch_px * mm_per_px,
        )
        cells = np.zeros(grid.shape, np.uint8)
        self._supported = cells, cells, np.zeros(shape, np.bool_)
        elastomer = Elastomer(thickness_mm, 1.0, poisson_ratio)
        self._shear = ElasticShear(grid, mm_per_px=mm_per_px, elastomer=elastomer)

    def displacement(self, px: Array, seen: Bool, contact: Bool | None = None) -> Float32:
        """Return the displacement at every pixel, interpolated linearly, (H, W, 2) float32."""
        return self._grid.enlarge_field(self.measure_field(px, seen, contact).cells_mm)

    def measure_field(self, px: Array, seen: Bool, contact: Bool | None = None) -> CoarseField:
        """Return the displacement of the surface that is now in each cell of a coarse grid.

        Parameters
        ----------
        px : (N, 2) float
            Present position of each marker, x and y.
        seen : (N,) bool
            Markers that are used.
        contact : (H, W) bool, optional
            The present contact area. With it the field bends sharply at the border of the contact;
            without it the bend is spread over about one pitch.

        Returns
        -------
        CoarseField
            0 if no marker is seen.
        """
        grid = self._grid
        count = np.count_nonzero(seen)
        moved_mm = (px - self.reference_px) * self._mm_per_px
        if count < len(seen):
            moved_mm[~seen] = 0.0
        elastic = None if contact is None else self._shear.fields(grid.share(contact))
        if elastic is None or count == 0:
            moved_mm = self._kriging.complete_values(moved_mm, seen)
            weighted = self._kriging.weight_values(moved_mm)
            sheared = np.zeros((2, *grid.shape), np.float32)
        else:
            columns = elastic.beside(moved_mm, grid, grid.in_cells(px))
            moved_mm, weighted, strength = self._subtract_fields(columns, seen)
            sheared = elastic.total(strength)
        residual = self._at_present(self._kriging.field(moved_mm), sheared)
        cells_mm = cv2.merge(list(sheared + residual))
        return CoarseField(np.asarray(cells_mm, np.float32), partial(self._std_mm, weighted))

    def find_valid_area(self, px: Array, seen: Bool) -> Bool:
        """Return where the field is valid, (H, W) bool: within a pitch of a marker that is seen.

        The array is that of the last call while the same cells are valid, and cannot be written.
        """
        grid = self._grid
        cells = rasterise_points(grid.in_cells(px[seen]), grid.shape)
        known, near, valid = self._supported
        if cells.tobytes() != known.tobytes():
            known_near, near = near, np.asarray(cv2.dilate(cells, self._around), np.uint8)
            if near.tobytes() != known_near.tobytes():
                valid = grid.enlarge_mask(near.view(np.bool_))
                valid.flags.writeable = False
            self._supported = cells, near, valid
        return valid

    def _std_mm(self, weighted: Float64) -> Float32:
        # [px] Where all markers agree, about half the noise of a marker
        # (``benchmarks/uncertainty.py``, on virtual contacts)
        noise_mm = np.float32(0.06 * self._mm_per_px)
        return np.hypot(self._kriging.std(weighted), noise_mm)

    def _subtract_fields(self, columns: Float64, seen: Bool) -> tuple[Float64, Float64, Float64]:
        """Residual displacements of the markers, also weighted, and strengths of the fields.

        The strengths are the generalised least-squares estimate under the kriging covariance.
        ``columns``, (N, 10), are x and y of the four fields and of the displacement.
        """
        columns = self._kriging.complete_values(columns, seen)
        pairs = columns, self._kriging.weight_values(columns)
        # the strength of a field is the same along x and y: both add to the same equations
        products = pairs[0].T @ pairs[1]
        products = products[::2, ::2] + products[1::2, 1::2]
        normal, right = products[:-1, :-1], products[:-1, -1]
        size = np.sqrt(np.maximum(normal.diagonal(), _TINY))
        # [ratio to the diagonal]
        scaled = normal / (size * size[:, None]) + 1e-3 * np.eye(len(size))
        strength = np.linalg.solve(scaled, right / size) / size
        left = np.zeros((5, 2, 2))
        left[:-1, 0, 0] = left[:-1, 1, 1] = -strength
        left[-1, 0, 0] = left[-1, 1, 1] = 1.0
        residual, weighted_residual = (each @ left.reshape(10, 2) for each in pairs)
        return residual, weighted_residual, strength

    def _at_present(self, residual: Float32, sheared: Float32) -> Float32:
        """Move a residual (2, M) on the half grid from undeformed to present positions.

        Both it and the result are smooth, so that they are moved on the half grid. The result is
        (2, rows, columns).
        """
        grid = self._grid
        undeformed = grid.refine_planes(residual.reshape(2, *self._half_shape))
        nodes, per_mm, shape = self._half_nodes, self._per_mm, (2, *self._half_shape)
        known = grid.sample_planes(sheared, nodes.T)
        start = present = grid.sample_planes(undeformed, nodes.T)
        for _ in range(2):  # smooth displacements converge in two (ADR 27)
            came_from = nodes - (known + present) * per_mm
            present = grid.sample_planes(undeformed, came_from.T)
        return grid.refine_planes((residual + (present - start)).reshape(shape))
