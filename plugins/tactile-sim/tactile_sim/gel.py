"""The gel of a virtual sensor, and imprints of objects in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.force.elastic_layer import (
    POISSON_RATIO,
    SHEAR_MODULUS_MPA,
    THICKNESS_MM,
    Elastomer,
)
from tactile_core.algorithms.force.viscoelasticity import Branch, SurfaceGrid
from tactile_core.algorithms.heights.sphere import cap
from tactile_core.errors import InputError
from tactile_core.interfaces.gel import Gel
from tactile_sim.contact_state import SurfaceState
from tactile_sim.indenters.solids import Indenter

NO_GEL_MM = -1e3  # Level of the rest surface outside the gel: nothing reaches it


# [ratio] Coulomb coefficient of a profile without ``gel.friction``: roughly that of painted
# silicone on smooth objects
FRICTION = 0.5


@dataclass(frozen=True)
class SoftGel:
    """Geometry and material of a gel.

    Attributes
    ----------
    elastomer : Elastomer
        Relaxed elastic properties, after all viscoelastic stress has decayed.
    branches : tuple of Branch
        Prony series of the extra stiffness before relaxation.
    friction : float
        Static Coulomb coefficient.
    friction_speed_mm_s : float or None
        Slip speed at which friction doubles; None if it does not depend on speed.
    kinetic_friction : float or None
        Coulomb coefficient of a node that slips; None if it is the static one.
    radius_mm : float or None
        Radius of a dome; None if flat.
    size_mm : (width, height) or None
        Size of the gel; None if larger than the field of view.
    crown_mm : float
        Height of the middle above the edges.
    """

    elastomer: Elastomer
    branches: tuple[Branch, ...] = ()
    friction: float = FRICTION
    friction_speed_mm_s: float | None = None
    radius_mm: float | None = None
    size_mm: tuple[float, float] | None = None
    crown_mm: float = 0.0
    kinetic_friction: float | None = None

    @classmethod
    def from_gel(cls, gel: Gel) -> SoftGel:
        """Return the gel of a profile; missing values default to those of common silicone."""
        return cls(
            Elastomer(
                gel.thickness_mm or THICKNESS_MM,
                gel.shear_modulus_mpa or SHEAR_MODULUS_MPA,
                gel.poisson_ratio or POISSON_RATIO,
            ),
            tuple(Branch(part.modulus_share, part.time_s) for part in gel.prony or ()),
            FRICTION if gel.friction is None else gel.friction,
            gel.friction_speed_mm_s,
            gel.radius_mm,
            gel.size_mm,
            gel.crown_mm or 0.0,
            gel.kinetic_friction,
        )

    def check_depth(self, depth_mm: float) -> None:
        """Raise an InputError if this depth reaches the plate behind the gel."""
        thickness = self.elastomer.thickness_mm
        if depth_mm >= thickness:
            raise InputError(
                f"the object would be pressed {depth_mm:.3g} mm deep into a gel that is "
                f"{thickness:g} mm thick; press less"
            )

    def extent_mm(self, view_mm: tuple[float, float]) -> tuple[float, float]:
        """Width and height of the area to solve on, for a field of view of this size.

        Without a known gel size it is the view plus a margin in which displacements decay. With
        one it is the gel plus a narrow gap between its periodic images, so that its edges behave
        as free; but what presses at one end of the view must not move the other end.
        """
        thickness = self.elastomer.thickness_mm
        decay = 2 * thickness  # of displacements
        if self.size_mm is None:
            return view_mm[0] + 2 * decay, view_mm[1] + 2 * decay
        gap = 0.2 * thickness  # a wider one acts as elastomer and stiffens the edges (ADR 21)
        width, height = (
            max(view + decay, size + gap) for view, size in zip(view_mm, self.size_mm, strict=True)
        )
        return width, height

    @property
    def is_flat(self) -> bool:
        """Whether the undeformed surface is a plane without edges."""
        return self.radius_mm is None and self.size_mm is None

    def rest_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """z of the undeformed gel surface: 0 in the middle, negative towards the camera."""
        shape = np.broadcast_shapes(x_mm.shape, y_mm.shape)
        rest = np.zeros(shape, np.result_type(x_mm, y_mm, np.float32))
        if self.radius_mm is not None:
            square = x_mm**2 + y_mm**2
            rest += cap(square, self.radius_mm) - self.radius_mm
            rest[square >= self.radius_mm**2] = NO_GEL_MM
        if self.size_mm is not None:
            # of squares, because numpy squares faster than it raises to a power
            u, v = (
                (2 * along / side) ** 2
                for along, side in zip((x_mm, y_mm), self.size_mm, strict=True)
            )
            if self.crown_mm:
                rest -= self.crown_mm * (u**2 + v**2)  # fourth power of the distance (ADR 21)
            beyond = np.maximum(u, v) > 1
            if beyond.any():
                rest[beyond] = NO_GEL_MM
        return rest

    def rest_on(self, grid: SurfaceGrid) -> Array:
        """(ny, nx) undeformed surface at the nodes of a grid."""
        return self.rest_mm(*grid.nodes_mm)


# Contact may extend this far beyond its outermost nodes: half a node, and one for rounding.
_REACH_SPACINGS = 1.5


@dataclass(frozen=True, eq=False)
class BallImprint:
    """Object in contact with a gel surface, seen at the pixels of the image.

    Attributes
    ----------
    indenter : Indenter
    gel : SoftGel
    grid : SurfaceGrid
    state : SurfaceState
        With a contact.
    mm_per_px : float
    """

    indenter: Indenter
    gel: SoftGel
    grid: SurfaceGrid
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
