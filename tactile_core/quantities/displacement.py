"""How far the skin is dragged along its plane, at every pixel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class DisplacementField(Quantity):
    """How far the skin is dragged along its plane, at every pixel.

    The value at x belongs to the skin that is now at x.

    Attributes
    ----------
    mm : (H, W, 2) float32
        Since the skin was untouched, or the load was tared: +x right, +y down.
    valid : (H, W) bool
        False where it is extended beyond the marks.
    """

    mm: Float32
    valid: Bool
    mm_per_px: float
    timestamp_s: float = 0.0

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """``displacement_mm (H, W, 2)``."""
        return {"displacement_mm": self.mm}
