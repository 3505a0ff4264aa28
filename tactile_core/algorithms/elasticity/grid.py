"""Grid of nodes on which the mechanics of the gel surface is solved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Array


@dataclass(frozen=True)
class Grid:
    """Rectangular, periodic grid of nodes centred on the image; x right, y down, mm.

    Leave a margin of a few gel thicknesses around the loaded area, because displacements wrap
    around at the borders.

    Attributes
    ----------
    nx, ny : int
        Number of nodes.
    spacing_mm : float
        Distance between adjacent nodes, the same along x and y.
    """

    nx: int
    ny: int
    spacing_mm: float

    @classmethod
    def covering(cls, width_mm: float, height_mm: float, spacing_mm: float) -> Grid:
        """Return the smallest grid that covers this area and whose size suits the FFT."""
        from scipy.fft import next_fast_len

        nx, ny = (
            next_fast_len(int(np.ceil(side / spacing_mm)), real=True)
            for side in (width_mm, height_mm)
        )
        return cls(nx, ny, spacing_mm)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of an array on the grid."""
        return self.ny, self.nx

    @property
    def cell_mm2(self) -> float:
        """Area of one node's cell."""
        return self.spacing_mm**2

    @cached_property
    def x_mm(self) -> Array:
        """(nx,) positions of the columns."""
        return from_middle(self.nx) * self.spacing_mm

    @cached_property
    def y_mm(self) -> Array:
        """(ny,) positions of the rows."""
        return from_middle(self.ny) * self.spacing_mm

    @cached_property
    def nodes_mm(self) -> Array:
        """(2, ny, nx) x and y of every node."""
        return np.stack(np.meshgrid(self.x_mm, self.y_mm))
