"""In-plane displacement of the gel surface, at every pixel."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import FieldSpec, MmPerPx, TimestampS
from tactile_core.quantities.layers import Layer, VectorMap
from tactile_core.quantities.on_demand import none
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class DisplacementField(Quantity):
    """In-plane displacement of the gel surface, at every pixel.

    The value at x is that of the surface point that is now at x.

    Attributes
    ----------
    cells_mm : (h, w, 2) float32
        Displacement relative to the reference, or to the last tare: +x right, +y down. One value
        per cell; cells of equal size tile the image, which has at least as many pixels as cells.
    valid : (H, W) bool
        False where the field is extrapolated beyond the markers.
    std_cells_mm : (h, w) float32 or None
        Standard deviation of a component, one value per cell; None if it is unknown.
    """

    cells_mm: Annotated[
        Float32, FieldSpec("mm", ("y", "x", "xy"), saved_as="displacement_mm", coarse=True)
    ]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="displacement_valid", validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    std_cells_mm: Annotated[
        Float32 | None,
        FieldSpec(
            "mm",
            ("y", "x"),
            saved_as="displacement_std_mm",
            std_of="displacement_mm",
            coarse=True,
        ),
    ] = field(default_factory=none)

    @property
    def std_mm(self) -> Float32 | None:
        """(H, W) standard deviation of a component at every pixel; None if it is unknown."""
        return None if self.std_cells_mm is None else self.full("std_cells_mm")

    @cached_property
    def mm(self) -> Float32:
        """(H, W, 2) float32: the field at every pixel, interpolated between centres of cells."""
        return self.full("cells_mm")

    def layers(self) -> tuple[Layer, ...]:
        """Return the magnitude, with arrows."""
        return (VectorMap(self.mm, self.valid, "mm", "displacement"),)
