"""The dense displacement field of a gel surface whose markers are tracked."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.pitch import pitch
from tactile_core.algorithms.arrays.places import struck
from tactile_core.algorithms.arrays.types import Array, Bool, Complex64, Float32, Float64
from tactile_core.algorithms.displacement.coarse_grid import CoarseGrid
from tactile_core.algorithms.displacement.contact_shear import ContactShear
from tactile_core.algorithms.displacement.kriging import KRIGING, Kriging
from tactile_core.algorithms.elasticity import POISSON_RATIO, THICKNESS_MM, Elastomer
from tactile_core.errors import InputError

_TINY = float(np.finfo(np.float32).tiny)


class SurfaceParameters(NamedTuple):
    """Parameters of the dense field. They are relative to the marker pitch and the gel thickness.

    Attributes
    ----------
    range_thicknesses : float, gel thicknesses
        Length scale of the covariance of the interpolated part.
        Source: chosen on virtual gels (ADR 27); no script derives it.
    cells_per_pitch : float, count
        Resolution of the coarse grid.
        Source: chosen by hand for speed; no script derives it.
    support_pitches : float, pitches
        The field is valid within this distance of a marker that is seen.
        Source: the distance to the next marker; beyond it the field is extrapolated.
    ridge : float, ratio
        Regularisation of the least-squares fit, relative to its diagonal.
        Source: chosen by hand; no script derives it.
    iterations : int, count
        Fixed-point iterations that move the field from undeformed to present positions.
        Source: chosen by hand; displacements are smooth, so that two converge (ADR 27).
    """

    range_thicknesses: float = 6.0
    cells_per_pitch: float = 4.0
    support_pitches: float = 1.0
    ridge: float = 1e-3
    iterations: int = 2


SURFACE = SurfaceParameters()
"""The values in use."""


class CoarseField(NamedTuple):
    """A displacement field and its standard deviation, each in cells that tile the image.

    Attributes
    ----------
    cells_mm : (rows, columns, 2) float32
        +x right, +y down.
    std_cells_mm : (rows, columns) float32
        Standard deviation of a component, on a grid of its own.
    """

    cells_mm: Float32
    std_cells_mm: Float32


class MarkedSurface:
    """Interpolate the displacements of markers to every pixel.

    Four elastic fields of the contact (:class:`ContactShear`) are fitted to the displacements of
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
        self._grid = grid = CoarseGrid.of(shape, self._pitch_px / SURFACE.cells_per_pitch)
        self._nodes = grid.nodes
        # tiled to every node, because broadcasting along an axis of two is slow
        self._per_mm = np.tile(
            (1 / (mm_per_px * grid.cell_px)).astype(np.float32), (*grid.shape, 1)
        )
        reach_px = min(SURFACE.support_pitches * self._pitch_px, max(shape))
        across, down = (2 * max(1, round(reach_px / side)) + 1 for side in grid.cell_px)
        self._around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, down))
        # the residual varies over a pitch, so that two nodes per pitch are enough
        self._half = grid.half
        self._kriging = Kriging(
            self.reference_px * mm_per_px,
            self._half.in_px(self._half.nodes).reshape(-1, 2) * mm_per_px,
            range_mm=SURFACE.range_thicknesses * thickness_mm,
            pitch_mm=self._pitch_px * mm_per_px,
        )
        elastomer = Elastomer(thickness_mm, 1.0, poisson_ratio)
        self._shear = ContactShear(grid, mm_per_px=mm_per_px, elastomer=elastomer)

    def displacement(self, px: Array, seen: Bool, contact: Bool | None = None) -> Float32:
        """Return the displacement at every pixel, interpolated linearly, (H, W, 2) float32."""
        return self._grid.enlarged(self.measured(px, seen, contact).cells_mm)

    def measured(self, px: Array, seen: Bool, contact: Bool | None = None) -> CoarseField:
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
        moved_mm = np.where(seen[:, None], (px - self.reference_px) * self._mm_per_px, 0.0)
        shear_fields = None if contact is None else self._shear.fields(grid.share(contact))
        if shear_fields is None or not seen.any():
            moved_mm = self._kriging.completed(moved_mm, seen)
            weighted = self._kriging.weighted(moved_mm)
            sheared = np.zeros((*grid.shape, 2), np.float32)
        else:
            at = grid.in_cells(px)
            moved_mm, weighted, strength = self._without(moved_mm, shear_fields, at, seen)
            sheared = (shear_fields @ strength.astype(np.complex64))[..., None].view(np.float32)
        residual = grid.refined(self._kriging.field(moved_mm).reshape(*self._half.shape, 2))
        std_mm = self._kriging.std(weighted).reshape(self._half.shape)
        noise_mm = np.float32(KRIGING.noise_px * self._mm_per_px)
        return CoarseField(self._at_present(residual, sheared), np.hypot(std_mm, noise_mm))

    def supported(self, px: Array, seen: Bool) -> Bool:
        """Return where the field is valid, (H, W) bool: within a pitch of a marker that is seen."""
        grid = self._grid
        near = np.asarray(cv2.dilate(struck(grid.in_cells(px[seen]), grid.shape), self._around))
        return grid.marked(near.view(np.bool_))

    def _without(
        self, moved_mm: Float64, fields_mm: Complex64, at: Float32, seen: Bool
    ) -> tuple[Float64, Float64, Float64]:
        """Residual displacements of the markers, also weighted, and strengths of the fields.

        The strengths are the generalised least-squares estimate under the kriging covariance.
        """
        there = self._grid.sampled(fields_mm.view(np.float32), at[:, None])[:, 0]
        columns = self._kriging.completed(np.hstack([there, moved_mm]), seen)
        # the strength of a field is the same along x and y: both add to the same equations
        pairs = columns, self._kriging.weighted(columns)
        fields, weighted = (a.view(np.complex128) for a in pairs)
        products = (fields.conj().T @ weighted).real
        normal, right = products[:-1, :-1], products[:-1, -1]
        size = np.sqrt(np.maximum(normal.diagonal(), _TINY))
        scaled = normal / (size * size[:, None])
        scaled.flat[:: len(size) + 1] += SURFACE.ridge
        strength = np.linalg.solve(scaled, right / size) / size
        residuals = (each[:, -1:] - each[:, :-1] @ strength[:, None] for each in (fields, weighted))
        residual, weighted_residual = (each.view(np.float64) for each in residuals)
        return residual, weighted_residual, strength

    def _at_present(self, residual: Float32, sheared: Float32) -> Float32:
        """Sum at present positions; ``residual`` refers to undeformed ones."""
        moved = sheared + residual
        for _ in range(SURFACE.iterations):
            moved = sheared + self._grid.sampled(residual, self._nodes - moved * self._per_mm)
        return moved
