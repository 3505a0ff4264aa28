"""The gel of a profile, as its mechanics needs it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.dome import cap
from tactile_core.algorithms.elasticity import (
    POISSON_RATIO,
    SHEAR_MODULUS_MPA,
    THICKNESS_MM,
    Elastomer,
)
from tactile_core.errors import InputError
from tactile_core.interfaces.gel import Gel
from tactile_core.sim.grid import Grid
from tactile_core.sim.viscoelasticity import Branch

FRICTION = 0.5
"""Of a profile that does not tell: painted silicone on smooth objects, roughly."""

NOTHING_MM = -1e3
"""Level of the rest surface beside the gel: out of reach."""

_MARGIN_THICKNESSES, _APART_THICKNESSES = 2.0, 0.2
_CROWN_POWER = 4


@dataclass(frozen=True)
class SoftGel:
    """What the mechanics needs to know of a gel.

    Attributes
    ----------
    elastomer : Elastomer
        In the end, when all stress that relaxes has relaxed.
    branches : tuple of Branch
        What is stiffer before.
    friction : float
        Coulomb's coefficient, at rest.
    friction_speed_mm_s : float or None
        Speed of slip at which it has doubled.
    radius_mm : float or None
        Of a dome.
    size_mm : (width, height) or None
    crown_mm : float
        How much lower its edges are than its middle.
    """

    elastomer: Elastomer
    branches: tuple[Branch, ...] = ()
    friction: float = FRICTION
    friction_speed_mm_s: float | None = None
    radius_mm: float | None = None
    size_mm: tuple[float, float] | None = None
    crown_mm: float = 0.0

    @classmethod
    def of(cls, gel: Gel) -> SoftGel:
        """Return the gel of a profile; what it does not tell is that of the usual silicone."""
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
        )

    def check_depth(self, depth_mm: float) -> None:
        """Refuse a depth that reaches the plate behind the gel, by an InputError."""
        thickness = self.elastomer.thickness_mm
        if depth_mm >= thickness:
            raise InputError(
                f"the object would be pressed {depth_mm:.3g} mm deep into a gel that is "
                f"{thickness:g} mm thick; press less"
            )

    def extent_mm(self, view_mm: tuple[float, float]) -> tuple[float, float]:
        """Width and height of the area to solve on, for a view of this size.

        The view and a margin in which displacements die out; or the gel, of which hardly more
        is between its repetitions than separates them, so that its edges are as good as free.
        """
        thickness = self.elastomer.thickness_mm
        if self.size_mm is None:
            margin = 2 * _MARGIN_THICKNESSES * thickness
            return view_mm[0] + margin, view_mm[1] + margin
        apart = _APART_THICKNESSES * thickness
        return max(view_mm[0], self.size_mm[0] + apart), max(view_mm[1], self.size_mm[1] + apart)

    def rest_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """z of the untouched skin: 0 at the middle, negative where it lies nearer to the camera."""
        rest = np.zeros(np.broadcast_shapes(x_mm.shape, y_mm.shape))
        if self.radius_mm is not None:
            square = x_mm**2 + y_mm**2
            rest += cap(square, self.radius_mm) - self.radius_mm
            rest[square >= self.radius_mm**2] = NOTHING_MM
        if self.size_mm is not None:
            u, v = (
                2 * np.abs(along) / side
                for along, side in zip((x_mm, y_mm), self.size_mm, strict=True)
            )
            rest -= self.crown_mm * (u**_CROWN_POWER + v**_CROWN_POWER)
            rest = np.where(np.maximum(u, v) > 1, NOTHING_MM, rest)
        return rest

    def rest_on(self, grid: Grid) -> Array:
        """(ny, nx) rest surface on a grid's nodes."""
        return self.rest_mm(*grid.nodes_mm)
