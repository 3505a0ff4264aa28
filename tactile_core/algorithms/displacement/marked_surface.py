"""The dense displacement field of a gel surface whose markers are tracked."""

from __future__ import annotations

import cv2
import numpy as np

from tactile_core.algorithms.arrays.pitch import pitch
from tactile_core.algorithms.arrays.places import struck
from tactile_core.algorithms.arrays.types import Array, Bool, Complex64, Float32, Float64
from tactile_core.algorithms.displacement.coarse_grid import CoarseGrid
from tactile_core.algorithms.displacement.contact_shear import ContactShear
from tactile_core.algorithms.displacement.kriging import Kriging
from tactile_core.algorithms.elasticity import POISSON_RATIO, THICKNESS_MM, Elastomer
from tactile_core.errors import InputError

_RANGE_THICKNESSES = 6.0
_CELLS_PER_PITCH = 4.0
_REACH_PITCHES = 1.0
_RIDGE = 1e-3
_STEPS = 2
_TINY = float(np.finfo(np.float32).tiny)


class MarkedSurface:
    """Turns the places of markers into the displacement at every pixel.

    What the contact explains (:class:`ContactShear`, four numbers fitted to the markers) is taken
    off the markers' displacements, the rest is interpolated (:class:`Kriging`), and both are added
    where the skin is now. All that depends on the untouched markers alone is computed once.

    Parameters
    ----------
    reference_px : (N, 2) float
        x and y of each marker on the untouched skin.
    shape : (H, W)
        Of the image.
    mm_per_px : float
        Scale of the image.
    thickness_mm, poisson_ratio : float
        Of the gel.

    Raises
    ------
    InputError
        The markers are not (N, 2).
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
        self._grid = grid = CoarseGrid.of(shape, self._pitch_px / _CELLS_PER_PITCH)
        self._nodes = grid.nodes
        # for each node, since broadcasting along so short an axis is slow
        self._per_mm = np.tile(
            (1 / (mm_per_px * grid.cell_px)).astype(np.float32), (*grid.shape, 1)
        )
        reach_px = min(_REACH_PITCHES * self._pitch_px, max(shape))
        across, down = (2 * max(1, round(reach_px / side)) + 1 for side in grid.cell_px)
        self._around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (across, down))
        # two nodes between markers are enough for what is as smooth as the markers are apart
        self._rough = grid.half
        self._kriging = Kriging(
            self.reference_px * mm_per_px,
            self._rough.in_px(self._rough.nodes).reshape(-1, 2) * mm_per_px,
            range_mm=_RANGE_THICKNESSES * thickness_mm,
        )
        elastomer = Elastomer(thickness_mm, 1.0, poisson_ratio)
        self._shear = ContactShear(grid, mm_per_px=mm_per_px, elastomer=elastomer)

    def displacement(self, px: Array, seen: Bool, contact: Bool | None = None) -> Float32:
        """(H, W, 2) float32: :meth:`cells` at every pixel, linear between their middles."""
        return self._grid.enlarged(self.cells(px, seen, contact))

    def cells(self, px: Array, seen: Bool, contact: Bool | None = None) -> Float32:
        """Return the displacement of the gel surface that is now in each cell of a coarse grid.

        Parameters
        ----------
        px : (N, 2) float
            x and y of each marker now.
        seen : (N,) bool
            The others have no say.
        contact : (H, W) bool, optional
            Where the object touches now. With it the field bends at the border of the contact,
            without it up to a pitch around.

        Returns
        -------
        (rows, columns, 2) float32
            +x right, +y down, mm; 0 where no marker is seen at all. The cells tile the image.
        """
        grid = self._grid
        moved_mm = np.where(seen[:, None], (px - self.reference_px) * self._mm_per_px, 0.0)
        pulled = None if contact is None else self._shear.fields(grid.share(contact))
        if pulled is None or not seen.any():
            moved_mm = self._kriging.completed(moved_mm, seen)
            sheared = np.zeros((*grid.shape, 2), np.float32)
        else:
            moved_mm, strength = self._without(moved_mm, pulled, grid.in_cells(px), seen)
            sheared = (pulled @ strength.astype(np.complex64))[..., None].view(np.float32)
        rest = grid.refined(self._kriging.field(moved_mm).reshape(*self._rough.shape, 2))
        return self._carried(rest, sheared)

    def supported(self, px: Array, seen: Bool) -> Bool:
        """(H, W) bool: within a pitch of a marker that is seen."""
        grid = self._grid
        near = np.asarray(cv2.dilate(struck(grid.in_cells(px[seen]), grid.shape), self._around))
        return grid.marked(near.view(np.bool_))

    def _without(
        self, moved_mm: Float64, pulled: Complex64, at: Float32, seen: Bool
    ) -> tuple[Float64, Float64]:
        """Displacements that the contact leaves unexplained, and the strength of its pulls.

        The strengths are those that make the rest most likely.
        """
        there = self._grid.sampled(pulled.view(np.float32), at[:, None])[:, 0]
        columns = self._kriging.completed(np.hstack([there, moved_mm]), seen)
        # along x and along y each field has one strength: both add to the same equations
        fields, against = (a.view(np.complex128) for a in (columns, self._kriging.weighed(columns)))
        products = (fields.conj().T @ against).real
        normal, right = products[:-1, :-1], products[:-1, -1]
        size = np.sqrt(np.maximum(normal.diagonal(), _TINY))
        scaled = normal / (size * size[:, None])
        scaled.flat[:: len(size) + 1] += _RIDGE
        strength = np.linalg.solve(scaled, right / size) / size
        left = fields[:, -1] - fields[:, :-1] @ strength
        return left[:, None].view(np.float64), strength

    def _carried(self, rest: Float32, sheared: Float32) -> Float32:
        """The sum at the present place of the skin, ``rest`` being told at its untouched place."""
        moved = sheared + rest
        for _ in range(_STEPS):
            moved = sheared + self._grid.sampled(rest, self._nodes - moved * self._per_mm)
        return moved
