"""Estimator ``core.force_elastic``: force and torque by inverting the mechanics of the gel."""

from __future__ import annotations

from typing import ClassVar

import cv2
import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, Elastomer
from tactile_core.algorithms.force.layer_fit import LayerFit, load_variance
from tactile_core.algorithms.force.surface_loads import Deformation, Shares
from tactile_core.algorithms.force.viscoelasticity import Branch, Memory, SurfaceGrid, TimeStep
from tactile_core.errors import InputError
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactMask,
    ContactStress,
    DisplacementField,
    Frame,
    HeightMap,
    Wrench,
)
from tactile_core.quantities.quantity import grid_of

# [count] Cells over the thickness of the gel, which spreads what a load moves: virtual rigs (ADR
# 73): twice as many change the force of light balls by 1 %, for four times the cells
_CELLS_PER_THICKNESS = 4.5


class ElasticForceOptions(Options):
    """Options of ``core.force_elastic``."""

    gel_tolerance: PositiveFloat = Field(
        default=0.1,
        description="Relative standard deviation of modulus, thickness and Poisson ratio as the "
        "profile gives them.",
    )
    history: bool | None = Field(
        default=None,
        description="Follow the relaxation of a gel with a Prony series by the times of the "
        "frames; null: where a camera stamped them, not for separate images.",
    )


class ElasticForce(Estimator):
    """Find the loads in the contact that deform the gel as measured, and sum them.

    The gel is a linear elastic layer on a rigid plate; the shape of the object does not matter.
    Normal force comes from the height in the contact, shear force and torque from the displacement.
    How far the gel is displaced beside the contact corrects its thickness and Poisson's ratio.
    Nothing is trained: the force is as accurate as the gel's shear modulus, which scales it.
    """

    Options: ClassVar[type[BaseModel]] = ElasticForceOptions
    needs_markers: ClassVar[bool] = True

    def __init__(self, options: ElasticForceOptions, context: SensorContext) -> None:
        super().__init__(options, context)
        self._tolerance = options.gel_tolerance
        gel, image = context.gel, context.image
        if gel.shear_modulus_mpa is None or gel.thickness_mm is None:
            missing = "shear_modulus_mpa" if gel.shear_modulus_mpa is None else "thickness_mm"
            raise InputError(
                f"core.force_elastic needs the gel's stiffness: give gel.{missing} in the profile, "
                f"or leave this step out"
            )
        nominal = Elastomer(
            gel.thickness_mm,
            gel.shear_modulus_mpa,
            POISSON_RATIO if gel.poisson_ratio is None else gel.poisson_ratio,
        )
        series = () if options.history is False else gel.prony or ()
        self._branches = tuple(Branch(part.modulus_share, part.time_s) for part in series)
        self._always = options.history is True
        self.stateful = bool(self._branches)
        per_cell_px = gel.thickness_mm / _CELLS_PER_THICKNESS / image.mm_per_px
        self._size = _cells((image.width_px, image.height_px), per_cell_px)
        self._cell_mm = image.width_px * image.mm_per_px / self._size[0]
        # [ratio] No load meets its own image: the response of a bonded layer ends within two
        # thicknesses
        width_mm, height_mm = (1.6 * count * self._cell_mm for count in self._size)
        grid = SurfaceGrid.covering(width_mm, height_mm, self._cell_mm)
        self._layer_fit = LayerFit(grid, nominal, self._tolerance)
        self._zero, self._last = np.zeros(4), np.zeros(4)
        self._memory: Memory | None = None
        self._time_s = 0.0

    def reset(self) -> None:
        """Forget the tare and the history."""
        self._zero, self._last = np.zeros(4), np.zeros(4)
        self._memory = None

    def resume(self) -> None:
        """Forget the history."""
        self._memory = None

    def tare(self, result: tuple[Wrench, ContactStress]) -> tuple[Wrench, ContactStress]:
        """Subtract the present load from all later ones; the stress stays that of the contact."""
        self._zero = self._last
        wrench, stress = result
        return Wrench.from_values(np.zeros(4), wrench.std, wrench.timestamp_s), stress

    def estimate(
        self,
        frame: Frame,
        height: HeightMap,
        contact: ContactMask,
        displacement: DisplacementField,
    ) -> tuple[Wrench, ContactStress]:
        """Return the load, zero without contact, and the stress whose sum it is."""
        follows = bool(self._branches) and (self._always or frame.wall_time_s > 0)
        measured = self._measure_deformation(height, contact, displacement, follows=follows)
        rows, columns = measured.contact.shape
        pressure = np.zeros((rows, columns), np.float32)
        shear = np.zeros((rows, columns, 2), np.float32)
        # [N] A lighter touch is not found: a virtual ball of 12 mm is from 0.06 N on
        self._last, variance = np.zeros(4), self._resultant_variance(0.03)
        if measured.contact.any():
            shares = Shares.from_contact(measured.contact, self._cell_mm)
            fit = self._layer_fit.fit(measured, shares)
            self._last = fit.loads.resultant
            variance = load_variance(fit, measured, self._cell_mm, self._tolerance)
            pressure[:] = fit.loads.pressure_mpa
            shear[:] = np.moveaxis(fit.loads.traction_mpa(shares), 0, 2)
        stress = ContactStress(pressure, shear, contact.mask, height.mm_per_px, height.timestamp_s)
        wrench = Wrench.from_values(self._last - self._zero, np.sqrt(variance), height.timestamp_s)
        return wrench, stress

    def _measure_deformation(
        self,
        height: HeightMap,
        contact: ContactMask,
        displacement: DisplacementField,
        *,
        follows: bool,
    ) -> Deformation:
        cells_mm = grid_of(height, "mm").of_image().cells
        moved = np.moveaxis(cv2.resize(displacement.cells_mm, self._size), 2, 0)
        moved = np.concatenate([moved, shrink_image(cells_mm, self._size)[None]])
        if follows:
            moved = self._relax_displacement(moved, height.timestamp_s)
        valid, touching = (_shares(mask, self._size) for mask in (displacement.valid, contact.mask))
        seen = Deformation(moved[2], moved[:2], valid > 0.5, _without_specks(touching))
        return seen.of_material(self._cell_mm)

    def _relax_displacement(self, moved: np.ndarray, time_s: float) -> np.ndarray:
        """Return the displacement that the same loads cause after relaxation."""
        if self._memory is None or time_s <= self._time_s:
            self._memory = Memory.none(self._branches, moved)
        else:
            step = TimeStep(self._branches, time_s - self._time_s)
            self._memory = self._memory.after(step, moved)
        self._time_s = time_s
        return self._memory.relaxed_mm(self._branches).astype(np.float32)

    def _resultant_variance(self, force_n: float) -> np.ndarray:
        """Return the variance of a resultant whose forces have this standard deviation."""
        arm_mm = self._size[0] * self._cell_mm / 4
        return np.array([force_n, force_n, force_n, force_n * arm_mm]) ** 2


def _shares(mask: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return the share of each cell, (rows, columns), that is in a mask of the image."""
    per_cell_px = min(whole / part for whole, part in zip(mask.shape[::-1], size, strict=True))
    step_px = max(1, int(per_cell_px / 6.0))  # [samples] a border is right by a hundredth
    samples = mask[step_px // 2 :: step_px, step_px // 2 :: step_px].astype(np.uint8)
    return np.asarray(shrink_image(samples * np.uint8(255), size) / np.float32(255))


def _without_specks(share: np.ndarray) -> np.ndarray:
    """Leave out what touches no cell that is mostly in contact: it is smaller than a cell."""
    mostly = (share > 0.5).astype(np.uint8)
    return np.asarray(share * cv2.dilate(mostly, np.ones((3, 3), np.uint8)))


def _cells(size_px: tuple[int, int], per_cell_px: float) -> tuple[int, int]:
    """Return the number of columns and rows of nearly square cells of about this size."""
    width_px, height_px = size_px
    most = max(1, int(width_px / per_cell_px * 1.15))
    least = max(1, int(width_px / per_cell_px * 0.87))
    rows = {
        columns: max(1, round(height_px * columns / width_px)) for columns in range(least, most + 1)
    }
    best = min(
        rows, key=lambda columns: abs(np.log(height_px * columns / width_px / rows[columns]))
    )
    return best, rows[best]
