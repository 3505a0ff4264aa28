"""Estimator ``core.force_elastic``: force and torque by inverting the mechanics of the gel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Self

import cv2
import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.shrinking import shrink_image
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, Elastomer
from tactile_core.algorithms.force.layer_fit import LayerFit, load_variance
from tactile_core.algorithms.force.surface_loads import Deformation, Shares
from tactile_core.algorithms.force.viscoelasticity import Branch, Memory, SurfaceGrid, TimeStep
from tactile_core.errors import CalibrationError, InputError
from tactile_core.formats.npz import read_npz, write_npz
from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import (
    FittedForce,
    ForceModel,
    ForceSamples,
    SensorContext,
)
from tactile_core.quantities import (
    ContactMask,
    ContactStress,
    DisplacementField,
    FieldSpec,
    Frame,
    HeightMap,
    Wrench,
)
from tactile_core.quantities.quantity import grid_of
from tactile_core.quantities.wrench import UNKNOWN_LOAD

# [count] Cells over the thickness of the gel, which spreads what a load moves: virtual rigs (ADR
# 73): twice as many change the force of light balls by 1 %, for four times the cells
_CELLS_PER_THICKNESS = 4.5

# [share] Standard deviation of loads after one weight was laid on: virtual units whose profile is
# wrong in modulus, thickness and Poisson's ratio have 7 to 14 % on all shapes
# (``experiments/known_weight.py``)
_FITTED = 0.1

_FILE = "stiffness.npz"


class ElasticForceOptions(Options):
    """Options of ``core.force_elastic``."""

    gel_tolerance: PositiveFloat = Field(
        default=0.1,
        description="Relative standard deviation of modulus, thickness and Poisson ratio as the "
        "profile gives them.",
    )
    modulus_tolerance: PositiveFloat | None = Field(
        default=None,
        description="The same of the modulus alone, if that is less certain; null: gel_tolerance. "
        "'tactile calibrate-force --weights' with one known weight replaces it.",
    )
    history: bool | None = Field(
        default=None,
        description="Follow the relaxation of a gel with a Prony series by the times of the "
        "frames; null: where a camera stamped them, not for separate images.",
    )


@dataclass(frozen=True, eq=False)
class GelStiffness(ForceModel):
    """How much stiffer a gel is than its profile says, measured with known weights.

    Attributes
    ----------
    factor : float
        On the shear modulus, and so on every load.
    std : float
        Its standard deviation, as a share of it.
    """

    factor: Annotated[float, FieldSpec()]
    std: Annotated[float, FieldSpec()]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (0 < self.factor < np.inf and 0 <= self.std < np.inf):
            raise CalibrationError(
                "no contact is seen under the weights; lay on heavier ones, or check the reference"
            )

    def forces(self, features: Float64) -> tuple[Float64, Float64]:
        """Predict the normal force; see :meth:`ForceModel.forces`."""
        found = np.full((len(features), 4), np.nan)
        found[:, 2] = self.factor * features[:, 0]
        return found, self.std * np.abs(found)

    def save(self, directory: Path) -> None:
        """Write ``stiffness.npz``."""
        write_npz(directory / _FILE, {"factor": np.array(self.factor), "std": np.array(self.std)})

    @classmethod
    def load(cls, directory: Path) -> Self:
        """Read ``stiffness.npz``.

        Raises
        ------
        CalibrationError
            The file is missing or damaged.
        """
        try:
            arrays = read_npz(directory / _FILE)
            return cls(float(arrays["factor"]), float(arrays["std"]))
        except (InputError, ValueError, LookupError, TypeError) as error:
            raise CalibrationError(
                f"{directory / _FILE} holds no stiffness; run 'tactile calibrate-force' again"
            ) from error


class ElasticForce(FittedForce):
    """Find the loads in the contact that deform the gel as measured, and sum them.

    The gel is a linear elastic layer on a rigid plate; the shape of the object does not matter.
    Normal force comes from the height in the contact, shear force and torque from the displacement.
    How far the gel is displaced beside the contact corrects its thickness and Poisson's ratio. A
    gel without markers shows the normal force alone.
    Nothing is trained: the force is as accurate as the gel's shear modulus, which scales it. One
    known weight measures that, by ``tactile calibrate-force``.
    """

    Options: ClassVar[type[BaseModel]] = ElasticForceOptions
    artefact: ClassVar[str] = "stiffness"
    fewest_sequences: ClassVar[int] = 1
    feature_names: ClassVar[tuple[str, ...]] = ("normal_force_n",)

    def __init__(self, options: ElasticForceOptions, context: SensorContext) -> None:
        super().__init__(options, context)
        self._modulus_tolerance = options.modulus_tolerance or options.gel_tolerance
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
        self._layer_fit = LayerFit(grid, nominal, options.gel_tolerance)
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
        stiffness: GelStiffness | None,
        frame: Frame,
        height: HeightMap,
        contact: ContactMask,
        displacement: DisplacementField | None,
    ) -> tuple[Wrench, ContactStress]:
        """Return the load, zero without contact, and the stress whose sum it is.

        Without markers nothing is known of shear: those components are 0 with a very large standard
        deviation, and the stress is the pressure alone.
        """
        known = stiffness or GelStiffness(1.0, self._modulus_tolerance)
        measured = self._measure_deformation(frame, height, contact, displacement)
        rows, columns = measured.contact.shape
        stress_mpa = np.zeros((3, rows, columns), np.float32)
        # [N] A lighter touch is not found: a virtual ball of 12 mm is from 0.06 N on
        self._last, variance = np.zeros(4), self._resultant_variance(0.03)
        if measured.contact.any():
            shares = Shares.from_contact(measured.contact, self._cell_mm)
            fit = self._layer_fit.fit(measured, shares)
            if stiffness is not None:  # it was measured with the layer's other errors
                fit = fit._replace(covariance=np.zeros((4, 4)))
            self._last = known.factor * fit.loads.resultant
            variance = load_variance(fit, measured, self._cell_mm, known.std) * known.factor**2
            stress_mpa[:2] = known.factor * fit.loads.traction_mpa(shares)
            stress_mpa[2] = known.factor * fit.loads.pressure_mpa
        if displacement is None:
            variance[[0, 1, 3]] = UNKNOWN_LOAD**2
        shear = np.moveaxis(stress_mpa[:2], 0, 2)
        stress = ContactStress(
            stress_mpa[2], shear, contact.mask, height.mm_per_px, height.timestamp_s
        )
        wrench = Wrench.from_values(self._last - self._zero, np.sqrt(variance), height.timestamp_s)
        return wrench, stress

    def features(
        self,
        frame: Frame,
        height: HeightMap,
        contact: ContactMask,
        displacement: DisplacementField | None,
    ) -> Float64:
        """(1,) float64: the normal force in N with the modulus that the profile gives."""
        measured = self._measure_deformation(frame, height, contact, displacement)
        if not measured.contact.any():
            return np.zeros(1)
        shares = Shares.from_contact(measured.contact, self._cell_mm)
        return self._layer_fit.fit(measured, shares).loads.resultant[2:3]

    def fit(self, sequences: Sequence[ForceSamples]) -> GelStiffness:
        """Fit the modulus to normal forces, such as one weight that is laid on the sensor.

        Raises
        ------
        CalibrationError
            No contact is seen under any of them.
        """
        found = np.array([one for each in sequences for one in each.features[:, 0]])
        acted = np.array([one for each in sequences for one in each.forces[:, 2]])
        loaded = np.isfinite(acted) & (acted > 0)
        if not loaded.any():  # what is known without any
            return GelStiffness(1.0, self._modulus_tolerance)
        found, acted = found[loaded], acted[loaded]
        factor = float(found @ acted) / max(float(found @ found), 1e-12)
        return GelStiffness(factor, _FITTED)

    def _measure_deformation(
        self,
        frame: Frame,
        height: HeightMap,
        contact: ContactMask,
        displacement: DisplacementField | None,
    ) -> Deformation:
        columns, rows = self._size
        moved, valid = np.zeros((3, rows, columns), np.float32), np.zeros((rows, columns), bool)
        moved[2] = shrink_image(grid_of(height, "mm").of_image().cells, self._size)
        if displacement is not None:
            moved[:2] = np.moveaxis(cv2.resize(displacement.cells_mm, self._size), 2, 0)
            valid = _shares(displacement.valid, self._size) > 0.5
        if self._branches and (self._always or frame.wall_time_s > 0):
            moved = self._relax_displacement(moved, height.timestamp_s)
        touching = _shares(contact.mask, self._size)
        seen = Deformation(moved[2], moved[:2], valid, _without_specks(touching))
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
