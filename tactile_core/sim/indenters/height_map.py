"""Indenter of any shape, given as a height map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.errors import InputError
from tactile_core.sim.indenters.shape import FAR_MM, Indenter
from tactile_core.sim.indenters.solids import positive


@dataclass(frozen=True, eq=False)
class HeightMapIndenter(Indenter):
    """Object whose lower side is a height map; its middle is the object's origin.

    Parameters
    ----------
    height_mm : (H, W)
        Protrusion of each point towards the gel: the highest point makes contact first. NaN
        outside the object. Interpolation between points is bilinear.
    mm_per_px : float
        Spacing of the points.
    """

    height_mm: Array
    mm_per_px: float

    def __post_init__(self) -> None:
        try:
            height = np.array(self.height_mm, np.float64)
        except (TypeError, ValueError):
            raise InputError("a height map should be rows of numbers of equal length") from None
        if height.ndim != 2 or min(height.shape) < 2:
            raise InputError(
                f"a height map should have two dimensions of 2 or more points, not {height.shape}"
            )
        if not np.isfinite(height).any() or np.isinf(height).any():
            raise InputError("a height map should have finite heights, or nan outside the object")
        positive("a height map's mm_per_px", self.mm_per_px)
        height.flags.writeable = False
        object.__setattr__(self, "height_mm", height)

    @property
    def detail_mm(self) -> float | None:
        """Shortest wavelength that the points can represent."""
        return 2 * self.mm_per_px

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        from scipy.ndimage import map_coordinates

        height = self.height_mm
        rows, columns = height.shape
        gap = np.where(np.isnan(height), FAR_MM, np.nanmax(height) - height)
        column = np.asarray(x_mm) / self.mm_per_px + (columns - 1) / 2
        row = np.asarray(y_mm) / self.mm_per_px + (rows - 1) / 2
        values = map_coordinates(gap, [row, column], order=1, cval=FAR_MM, prefilter=False)
        return np.asarray(values)
