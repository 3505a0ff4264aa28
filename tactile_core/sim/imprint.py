"""The object's surface at the pixels of the image, where it lies below that of the coarse gel.

The mechanics knows the gel surface at its nodes and interpolates between them. The gel cannot
penetrate the object, so at every pixel the gel surface is at least as deep as the object's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.sim.contact_state import SurfaceState
from tactile_core.sim.gel import SoftGel
from tactile_core.sim.indenters.solids import Indenter

# Contact may extend this far beyond its outermost nodes: half a node, and one for rounding.
_REACH_SPACINGS = 1.5


@dataclass(frozen=True, eq=False)
class Imprint:
    """Object in contact with a gel surface, seen at the pixels of the image.

    Attributes
    ----------
    indenter : Indenter
    gel : SoftGel
    grid : Grid
    state : SurfaceState
        With a contact.
    mm_per_px : float
    """

    indenter: Indenter
    gel: SoftGel
    grid: Grid
    state: SurfaceState
    mm_per_px: float

    def window(self, shape: tuple[int, int]) -> tuple[slice, slice]:
        """Rows and columns of an image that contain the contact; empty if it is out of view."""
        contact = self.state.contact
        sides = []
        for axis, nodes, size in ((1, self.grid.y_mm, shape[0]), (0, self.grid.x_mm, shape[1])):
            touched = nodes[contact.any(axis)]
            moved = self.state.displacement_mm[1 - axis][contact]
            reach = _REACH_SPACINGS * self.grid.spacing_mm
            ends = touched[0] + moved.min() - reach, touched[-1] + moved.max() + reach
            middle = (size - 1) / 2
            first, last = (int(np.clip(end / self.mm_per_px + middle, 0, size)) for end in ends)
            sides.append(slice(first, last))
        return sides[0], sides[1]

    def deepen(self, height_mm: Float32, displacement_mm: Float32) -> None:
        """Lower the gel surface to the object, in place.

        Parameters
        ----------
        height_mm : (H, W) float32
            Interpolated from the nodes; overwritten.
        displacement_mm : (H, W, 2) float32
            In-plane displacement.
        """
        rows, columns = window = self.window(height_mm.shape)
        y, x = (
            np.float32(self.mm_per_px)
            * (np.arange(part.start, part.stop, dtype=np.float32) - np.float32((size - 1) / 2))
            for part, size in zip(window, height_mm.shape, strict=True)
        )
        lowered = np.float32(self.state.depth_mm - self.state.level_mm)
        object_mm = self._object_mm(x, y[:, None], displacement_mm[rows, columns]) + lowered
        here = height_mm[rows, columns]
        np.maximum(here, object_mm, out=here, casting="same_kind")

    def _object_mm(self, x: Array, y: Array, moved: Float32) -> Array:
        x, y = np.broadcast_arrays(x, y)
        gap = self.indenter.gap_mm(*self.state.pose.to_object_frame(x, y))
        if self.gel.is_flat:
            return -gap
        return self.gel.rest_mm(x - moved[..., 0], y - moved[..., 1]) - gap
