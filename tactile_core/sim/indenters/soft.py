"""Soft objects: a layer of elastomer on a rigid core of any shape."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.elasticity import POISSON_RATIO, Elastomer
from tactile_core.errors import InputError
from tactile_core.sim.indenters.shape import Indenter
from tactile_core.sim.indenters.solids import positive


@dataclass(frozen=True)
class Softness:
    """Layer of elastomer on an object.

    Parameters
    ----------
    shear_modulus_mpa : float
        Its relaxed value; the layer is elastic without viscosity.
    thickness_mm : float
    poisson_ratio : float
        Above 0 and below 0.5.
    """

    shear_modulus_mpa: float
    thickness_mm: float
    poisson_ratio: float = POISSON_RATIO

    def __post_init__(self) -> None:
        positive("a soft object's shear_modulus_mpa", self.shear_modulus_mpa)
        positive("a soft object's thickness_mm", self.thickness_mm)
        if not 0 < self.poisson_ratio < 0.5:
            raise InputError(
                f"a soft object's poisson_ratio should be between 0 and 0.5, not "
                f"{self.poisson_ratio:g}"
            )

    @property
    def elastomer(self) -> Elastomer:
        """The layer, for the mechanics."""
        return Elastomer(self.thickness_mm, self.shear_modulus_mpa, self.poisson_ratio)


@dataclass(frozen=True)
class Soft(Indenter):
    """Object whose surface is soft.

    Parameters
    ----------
    base : Indenter
        Its undeformed shape.
    softness : Softness
    """

    base: Indenter
    softness: Softness

    @property
    def rolling_radius_mm(self) -> float | None:
        """That of the shape."""
        return self.base.rolling_radius_mm

    @property
    def rolls_along_x(self) -> bool:
        """That of the shape."""
        return self.base.rolls_along_x

    @property
    def elastomer(self) -> Elastomer | None:
        """The soft layer."""
        return self.softness.elastomer

    @property
    def detail_mm(self) -> float | None:
        """That of the shape."""
        return self.base.detail_mm

    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """See :meth:`Indenter.gap_mm`."""
        return self.base.gap_mm(x_mm, y_mm)
