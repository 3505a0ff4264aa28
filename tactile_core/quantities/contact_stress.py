"""Stress that the object puts on the gel surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import FieldSpec, MmPerPx, TimestampS
from tactile_core.quantities.layers import Layer, ScalarMap, VectorMap
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class ContactStress(Quantity):
    """Normal and shear stress that the object puts on the gel surface, N/mm².

    Their integrals over the image are the forces of :class:`Wrench`.

    Attributes
    ----------
    pressure_cells_mpa : (h, w) float32
        Positive in compression; 0 out of contact. One value per cell; cells of equal size tile the
        image.
    shear_cells_mpa : (h, w, 2) float32
        Shear stress along x and y: positive where the surface is sheared towards +x, +y.
    contact : (H, W) bool
        Where the object touches.
    """

    pressure_cells_mpa: Annotated[
        Float32, FieldSpec("MPa", ("y", "x"), saved_as="pressure_mpa", coarse=True)
    ]
    shear_cells_mpa: Annotated[
        Float32, FieldSpec("MPa", ("y", "x", "xy"), saved_as="shear_stress_mpa", coarse=True)
    ]
    contact: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="stress_contact")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0

    @property
    def pressure_mpa(self) -> Float32:
        """(H, W) float32 pressure at every pixel."""
        return np.asarray(self.full("pressure_cells_mpa"), np.float32)

    @property
    def shear_mpa(self) -> Float32:
        """(H, W, 2) float32 shear stress at every pixel."""
        return np.asarray(self.full("shear_cells_mpa"), np.float32)

    def layers(self) -> tuple[Layer, ...]:
        """Return the maps of pressure and of shear stress."""
        return (
            ScalarMap(self.pressure_mpa, "MPa", "pressure"),
            VectorMap(self.shear_mpa, None, "MPa", "shear stress"),
        )
