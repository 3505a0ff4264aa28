"""Estimator ``core.force_elastic``: force and torque by inverting the mechanics of the gel."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import cv2
import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.shrinking import shrunk
from tactile_core.algorithms.elasticity import POISSON_RATIO, Elastomer
from tactile_core.algorithms.elasticity.elastic_layer import ElasticLayer
from tactile_core.algorithms.elasticity.grid import Grid
from tactile_core.algorithms.elasticity.surface_loads import pressure_mpa, resultant, traction_mpa
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactMask, DisplacementField, HeightMap, Wrench


class ElasticForceParameters(NamedTuple):
    """Parameters of the grid. Nothing sets them from outside: they are ratios.

    Attributes
    ----------
    cells_per_thickness : float, count
        Cells over the thickness of the gel, which spreads what a load moves.
        Source: virtual rigs (``experiments/elastic_force.py``): finer cells give the same force.
    margin : float, ratio
        Size of the periodic grid over that of the view, so that no load meets its own image.
        Source: virtual rigs: the response of a bonded layer ends within two thicknesses.
    """

    cells_per_thickness: float = 9.0
    margin: float = 1.6


ELASTIC_FORCE = ElasticForceParameters()
"""The values in use."""


class ElasticForce(Estimator):
    """Find the loads in the contact that deform the gel as measured, and sum them.

    The gel is a linear elastic layer on a rigid plate; the shape of the object does not matter.
    Normal force comes from the height in the contact, shear force and torque from the displacement.
    Nothing is trained: the force is as accurate as the gel's shear modulus, which scales it, and
    normal force depends on its thickness and Poisson's ratio too.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        gel, image = context.gel, context.image
        if gel.shear_modulus_mpa is None or gel.thickness_mm is None:
            missing = "shear_modulus_mpa" if gel.shear_modulus_mpa is None else "thickness_mm"
            raise InputError(
                f"core.force_elastic needs the gel's stiffness: give gel.{missing} in the profile, "
                f"or leave this step out"
            )
        self._elastomer = Elastomer(
            gel.thickness_mm,
            gel.shear_modulus_mpa,
            POISSON_RATIO if gel.poisson_ratio is None else gel.poisson_ratio,
        )
        per_cell_px = gel.thickness_mm / ELASTIC_FORCE.cells_per_thickness / image.mm_per_px
        stride = max(1, round(per_cell_px))
        self._size = max(1, image.width_px // stride), max(1, image.height_px // stride)
        self._cell_mm = image.width_px * image.mm_per_px / self._size[0]
        self._layer: ElasticLayer | None = None
        self._zero = np.zeros(4)
        self._last = np.zeros(4)

    def reset(self) -> None:
        """Forget the tare."""
        self._zero, self._last = np.zeros(4), np.zeros(4)

    def tare(self, result: Wrench) -> Wrench:
        """Subtract the present load from all later ones."""
        self._zero = self._last
        return Wrench(0.0, 0.0, 0.0, 0.0, timestamp_s=result.timestamp_s)

    def estimate(
        self, height: HeightMap, contact: ContactMask, displacement: DisplacementField
    ) -> Wrench:
        """Return the load; zero without contact."""
        touching = shrunk(contact.mask.astype(np.float32), self._size) > 0.5
        self._last = np.zeros(4)
        if touching.any():
            self._last = self._found(height, touching, displacement)
        fx, fy, fz, tz = map(float, self._last - self._zero)
        return Wrench(fx, fy, fz, tz, timestamp_s=height.timestamp_s)

    def _found(
        self, height: HeightMap, touching: np.ndarray, displacement: DisplacementField
    ) -> np.ndarray:
        layer = self._layer or self._made()
        pressure = pressure_mpa(layer, shrunk(height.mm, self._size), touching)
        moved = np.moveaxis(cv2.resize(displacement.cells_mm, self._size), 2, 0)
        valid = shrunk(displacement.valid.astype(np.float32), self._size) > 0.5
        traction = traction_mpa(layer, moved, valid, touching, pressure)
        return resultant(pressure, traction, self._cell_mm)

    def _made(self) -> ElasticLayer:
        columns, rows = self._size
        width_mm, height_mm = (
            ELASTIC_FORCE.margin * count * self._cell_mm for count in (columns, rows)
        )
        grid = Grid.covering(width_mm, height_mm, self._cell_mm)
        self._layer = ElasticLayer(grid, self._elastomer, np.float64)
        return self._layer
