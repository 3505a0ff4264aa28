"""Base class of indenters: rigid shapes above the gel surface."""

from __future__ import annotations

from abc import ABC, abstractmethod

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.elasticity import Elastomer

FAR_MM = 1e3  # Gap outside the object, mm: out of reach of the gel


class Indenter(ABC):
    """Object in its own frame, undeformed: x right, y down, z away from the gel.

    Immutable and picklable; the stage holds its pose.
    """

    @abstractmethod
    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """Height of the lower side above the lowest point, mm, at any positions.

        Non-negative, 0 at the lowest point, and :data:`FAR_MM` outside the object.
        """

    @property
    def rolling_radius_mm(self) -> float | None:
        """Radius of a surface of revolution that can roll; None if the object cannot roll."""
        return None

    @property
    def rolls_along_x(self) -> bool:
        """Whether the object can roll along its own x axis in addition to y."""
        return True

    @property
    def elastomer(self) -> Elastomer | None:
        """Material of a soft object, a layer on a rigid core; None if rigid."""
        return None

    @property
    def detail_mm(self) -> float | None:
        """Size of the finest feature, which the nodes should resolve; None if smooth."""
        return None
