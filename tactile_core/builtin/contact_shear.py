"""Estimator ``core.contact_shear``: shear of the surface in contact, and the share that sticks."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.types import Bool, Complex64
from tactile_core.algorithms.slip.recent_fields import coarse, coarse_field, pick_pixels, stride_of
from tactile_core.algorithms.slip.sheared_contact import SHEARED_CONTACT, Load, ShearedContact
from tactile_core.algorithms.slip.stick_region import STICK_REGION
from tactile_core.algorithms.slip.surface_view import VIEW
from tactile_core.algorithms.slip.wide_contact import fills_view
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactShear, DisplacementField, MarkerField, SlipContact
from tactile_core.quantities.on_demand import grid_of


class SHEAR:
    """Parameters of the step that are not options."""

    # [count] Grid points with a valid displacement that are needed to ignore the others.
    min_valid_points = 12


class _Observation(NamedTuple):
    """The contact in one frame."""

    field: Complex64
    mask: Bool
    load: Load
    blurred: bool
    wide: bool
    std_mm: float | None
    markers: int | None
    time_s: float


class ShearOfContact(Estimator):
    """Measure slip in the displacement field.

    The degree of slip grows as the stick region shrinks, and as it decelerates.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    class Options(device.Options):
        """Options of the step."""

        window_mm: PositiveFloat = Field(
            default=SHEARED_CONTACT.window_mm,
            description="Motion of the contact over which slip is measured, in mm.",
        )
        tolerance: float = Field(
            default=SHEARED_CONTACT.tolerance,
            gt=0,
            lt=1,
            description="A point sticks if it lags behind the stick region by less than this share "
            "of its motion; up to 2.5 times that in rotation if the contact is found in the image.",
        )
        noise_mm: PositiveFloat = Field(
            default=STICK_REGION.noise_mm,
            description="Noise of a displacement along x or y, in mm.",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        chosen = self.Options.model_validate(options.model_dump())
        self._stride = stride_of(context.image.width_px)
        self._contact = ShearedContact(
            self._stride * context.image.mm_per_px,
            window_mm=chosen.window_mm,
            tolerance=chosen.tolerance,
            noise_mm=chosen.noise_mm,
        )
        self._valid: Bool | None = None
        self._supported: Bool | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the contact."""
        self._contact.release()
        self._last: _Observation | None = None

    def tare(self, result: ContactShear) -> ContactShear:
        """Measure from the present frame on."""
        self._contact.release()
        return result if self._last is None else self._measure_shear(self._last)

    def estimate(
        self, contact: SlipContact, displacement: DisplacementField, markers: MarkerField | None
    ) -> ContactShear:
        """Return the shear; without contact only whether the field is usable."""
        seen = None if markers is None else int(np.count_nonzero(markers.seen))
        supported = self._supported_points(displacement.valid)
        if (seen is not None and seen < VIEW.min_markers) or supported is None:
            self.reset()
            return ContactShear(False, timestamp_s=displacement.timestamp_s)
        grid = grid_of(contact, "mask")
        # that of the step before has a grid of this stride
        mask = (
            grid.cells if grid.step_px == self._stride else pick_pixels(contact.mask, self._stride)
        )
        if not np.count_nonzero(mask):
            self.reset()
            return ContactShear(True, timestamp_s=displacement.timestamp_s)
        valid = mask & supported
        chosen = valid if np.count_nonzero(valid) >= SHEAR.min_valid_points else mask
        wide = fills_view(mask)
        self._last = _Observation(
            coarse_field(
                displacement.cells_mm,
                displacement.valid.shape,
                self._stride,
            ),
            chosen,
            Load(contact.area, contact.depth),
            contact.source == "image",
            wide,
            self._std_mm(displacement, chosen) if wide else None,
            seen,
            displacement.timestamp_s,
        )
        return self._measure_shear(self._last)

    def _measure_shear(self, now: _Observation) -> ContactShear:
        cues = self._contact.update(
            now.field,
            now.mask,
            now.load,
            blurred=now.blurred,
            wide=now.wide,
            std_mm=now.std_mm,
            markers=now.markers,
        )
        degree = cues.degree
        return ContactShear(
            True,
            degree,
            cues.stick_share,
            cues.motion_mm,
            cues.rotation_mm,
            math.degrees(cues.rotation_rad),
            cues.entropy_bits,
            self._contact.restarted,
            cues.std_of(degree),
            cues.deceleration,
            now.time_s,
        )

    def _supported_points(self, valid: Bool) -> Bool | None:
        """Return where a field is valid on the grid, (h, w); None if nowhere, by its (H, W)."""
        # most often the array is that of the frame before
        if valid is not self._valid:
            self._valid = valid
            self._supported = pick_pixels(valid, self._stride) if valid.any() else None
        return self._supported

    def _std_mm(self, displacement: DisplacementField, chosen: Bool) -> float | None:
        """Typical standard deviation of a field at the chosen grid points (h, w)."""
        cells_mm = displacement.std_cells_mm
        if cells_mm is None:
            return None
        return float(np.median(coarse(cells_mm, displacement.valid.shape, self._stride)[chosen]))
