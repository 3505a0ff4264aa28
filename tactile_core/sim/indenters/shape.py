"""What presses: a rigid shape above the skin."""

from __future__ import annotations

from abc import ABC, abstractmethod

from tactile_core.algorithms.arrays.types import Array

FAR_MM = 1e3
"""Height of what is not there: beside an object there is nothing within reach."""


class Indenter(ABC):
    """A rigid object, seen from below in its own frame: x right, y down, z away from the skin.

    Immutable and picklable; where it is and how it is turned is the stage's business.
    """

    @abstractmethod
    def gap_mm(self, x_mm: Array, y_mm: Array) -> Array:
        """Height of its lower side over its lowest point, mm, at any positions.

        Nowhere negative, 0 at the lowest point, and :data:`FAR_MM` where there is nothing.
        """

    @property
    def rolling_radius_mm(self) -> float | None:
        """Radius on which it rolls and looks the same afterwards; None cannot roll."""
        return None

    @property
    def rolls_along_x(self) -> bool:
        """Whether it can roll along its own x too, and not only along its y."""
        return True

    @property
    def detail_mm(self) -> float | None:
        """Size of its finest feature, which the nodes should resolve; None is smooth."""
        return None
