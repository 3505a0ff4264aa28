"""How far the gel surface is dragged along its plane, at every pixel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import FieldSpec, MmPerPx, TimestampS
from tactile_core.quantities.layers import Layer, VectorMap
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class DisplacementField(Quantity):
    """How far the gel surface is dragged along its plane, at every pixel.

    The value at x belongs to the part of the surface that is now at x.

    Attributes
    ----------
    cells_mm : (h, w, 2) float32
        Since the gel was untouched, or the load was tared: +x right, +y down; of cells of equal
        size that tile the image, at most as many as it has pixels.
    valid : (H, W) bool
        False where it is extended beyond the markers.
    """

    cells_mm: Annotated[
        Float32, FieldSpec("mm", ("y", "x", "xy"), saved_as="displacement_mm", coarse=True)
    ]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="displacement_valid", validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0

    @cached_property
    def mm(self) -> Float32:
        """(H, W, 2) float32: the field at every pixel, linear between the middles of cells."""
        return self.full("cells_mm")

    def layers(self) -> tuple[Layer, ...]:
        """The magnitude, with arrows."""
        return (VectorMap(self.mm, self.valid, "mm", "displacement"),)
