"""Slopes on a grid that is coarser than the image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.shrinking import interpolate_cells, shrink_image
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.normals import planes_to_gradient, to_normal_xy

# Heights are integrated from means over 2 × 2 cells where so many are left. Source: chosen by hand:
# a grid of 160 × 120, on which contacts are found, too (ADR 84).
HEIGHT_CELLS = 160 * 120


class SlopeCells(NamedTuple):
    """Slopes on a grid that is as coarse as their smoothing, or what is done with them, allows.

    Attributes
    ----------
    gx, gy : (h, w) float32
        ∂z/∂x and ∂z/∂y at the centres of the cells, dimensionless.
    step_px : int
        Side of a cell. The last cells may reach beyond the image.
    as_normals : bool
        Whether unit normals are interpolated between the cells, or slopes. A model is best
        interpolated in what it computes.
    averaged : bool
        Whether the cells are wider than the smoothing allows, so that they hold means over four
        smaller ones.
    """

    gx: Float32
    gy: Float32
    step_px: int
    as_normals: bool = True
    averaged: bool = False

    def for_heights(self) -> SlopeCells:
        """Return the slopes on the grid to integrate them on.

        Heights are smoother than slopes, so means over 2 × 2 cells suffice where these are small.
        """
        if self.averaged or self.step_px == 1 or not averaged_for_heights(self.gx.shape):
            return self
        rows, columns = self.gx.shape
        gx, gy = (shrink_image(plane, (columns // 2, rows // 2)) for plane in (self.gx, self.gy))
        return SlopeCells(gx, gy, 2 * self.step_px, self.as_normals, averaged=True)

    def image(self, shape: tuple[int, int]) -> tuple[Float32, Float32]:
        """Return the slopes of every pixel of an (H, W) image."""
        if self.step_px == 1:
            return self.gx, self.gy
        if not self.as_normals:
            gx, gy = (interpolate_cells(plane, self.step_px, shape) for plane in (self.gx, self.gy))
            return gx, gy
        normal_xy = to_normal_xy(np.stack([self.gx, self.gy], axis=-1))
        gx, gy = (interpolate_cells(normal_xy[..., k], self.step_px, shape) for k in (0, 1))
        planes_to_gradient(gx, gy)
        return gx, gy


def averaged_for_heights(shape: tuple[int, ...]) -> bool:
    """Whether heights are integrated from means over 2 × 2 cells of an (h, w) grid of slopes."""
    rows, columns = shape
    return rows % 2 == columns % 2 == 0 and rows * columns >= 4 * HEIGHT_CELLS
