"""Estimator ``core.slip``: whether the contact sticks, slips incipiently or slips."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.types import Bool, Complex64
from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.imprint import IMPRINT, ImprintMotion, ImprintTracker
from tactile_core.algorithms.slip.plane import coarse, stride_of
from tactile_core.algorithms.slip.sheared_contact import SHEARED_CONTACT, Load, ShearedContact
from tactile_core.algorithms.slip.state import Kind, SlipMachine, Thresholds
from tactile_core.algorithms.slip.stick_region import STICK_REGION
from tactile_core.algorithms.slip.surface_view import VIEW
from tactile_core.builtin.slip_touch import TouchFinder
from tactile_core.conditioning.marker_mask import MarkerFinder
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    HeightMap,
    MarkerField,
    Reference,
    SlipState,
)


class SlipParameters(NamedTuple):
    """Parameters of the step that are not options.

    Attributes
    ----------
    unknown_contact_weight : float, ratio
        Weight of the field's degree where neither the contact nor the load is known, so that it
        stays below the degree of an imprint that slips.
        Source: chosen by hand: the field ranks recorded lifts wrongly there (ADR 29).
    min_valid_points : int, count
        Grid points with a valid displacement that are needed to ignore the others.
        Source: chosen by hand; no script derives it.
    """

    unknown_contact_weight: float = 0.2
    min_valid_points: int = 12


SLIP = SlipParameters()
"""The values in use."""


class _Observation(NamedTuple):
    """The contact in one frame."""

    field: Complex64
    mask: Bool
    load: Load
    blurred: bool
    imprint: ImprintMotion | None
    knows_contact: bool
    knows_load: bool
    time_s: float


class Slip(Estimator):
    """Detect incipient and gross slip from the displacement field and from the object's imprint.

    The degree of slip grows as the stick region shrinks, and as it decelerates. The contact is the
    area inside the steep border in the height map, else in the change of the image, else the
    surface that is sheared furthest.

    With markers and frames, the imprint of the object is tracked relative to the gel surface. An
    imprint that moves means gross slip, once the field warns of it. Without a height map and
    without a reference of the undeformed surface, only the imprint reports gross slip, and the
    field warns.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    class Options(device.Options):
        """Options of the step.

        The degrees are derived by ``benchmarks/slip_thresholds.py``.
        """

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
        incipient: float = Field(
            default=0.28, ge=0, le=1, description="Degree at which incipient slip begins."
        )
        incipient_ends: float = Field(
            default=0.19, ge=0, le=1, description="Degree below which the contact sticks again."
        )
        slip: float = Field(
            default=0.43, ge=0, le=1, description="Degree at which gross slip begins."
        )
        slip_ends: float = Field(
            default=0.35, ge=0, le=1, description="Degree below which gross slip ends."
        )
        imprint_lost: PositiveFloat = Field(
            default=IMPRINT.slip_share,
            description="Share of the imprint that has left its position on the gel surface in "
            "gross slip; chosen on recorded lifts (docs/reference/accuracy.md).",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        chosen = self.Options.model_validate(options.model_dump())
        self._markers = None if context.gel.markers == "auto" else MarkerFinder.of(context)
        stride = stride_of(context.image.width_px)
        spacing_mm = stride * context.image.mm_per_px
        marker_px = 0.0 if self._markers is None else self._markers.diameter_px
        self._touch = TouchFinder(stride, spacing_mm, marker_px)
        self._contact = ShearedContact(
            spacing_mm,
            window_mm=chosen.window_mm,
            tolerance=chosen.tolerance,
            noise_mm=chosen.noise_mm,
        )
        self._machine = SlipMachine(
            Thresholds(
                incipient=chosen.incipient,
                incipient_ends=chosen.incipient_ends,
                slip=chosen.slip,
                slip_ends=chosen.slip_ends,
            )
        )
        self._warning_only = float(np.nextafter(chosen.slip, 0))
        self._imprint_lost = chosen.imprint_lost
        self._imprint: ImprintTracker | None = None
        self._imprint_of: Reference | None = None
        self._last: _Observation | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the contact and all earlier ones."""
        self._forget()
        self._touch.reset()
        if self._imprint is not None:
            self._imprint.reset()

    def tare(self, result: SlipState) -> SlipState:
        """Measure slip from the present frame on."""
        self._contact.release()
        if self._last is None:
            return result
        tracked = self._imprint is not None and self._last.imprint is not None
        imprint = self._imprint.restart() if self._imprint is not None and tracked else None
        return self._state(self._last._replace(imprint=imprint))

    def estimate(
        self,
        displacement: DisplacementField,
        frame: Frame | None,
        reference: Reference | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> SlipState:
        """Return the state; ``none`` without contact."""
        time_s = displacement.timestamp_s
        imprint = self._imprint_motion(frame, reference, markers)
        field = coarse(displacement.mm, self._touch.stride)
        mask, load, blurred = self._touch.find(
            np.abs(field), frame, reference, markers, height, contact
        )
        if not mask.any():
            self._forget()
            if imprint is None or contact is not None:
                return SlipState("none", 0.0, timestamp_s=time_s)
            if not self._slid(imprint):
                return SlipState("none", imprint.degree, timestamp_s=time_s)
            return SlipState("slip", imprint.degree, imprint.kind, timestamp_s=time_s)
        valid = mask & self._touch.picked(displacement.valid)
        if np.count_nonzero(valid) >= SLIP.min_valid_points:
            mask = valid
        # a first frame as reference may show a contact: then neither the area nor the load is known
        knows_load = reference is not None and not reference.relative
        self._last = _Observation(
            field, mask, load, blurred, imprint, contact is not None, knows_load, time_s
        )
        return self._state(self._last)

    def _state(self, now: _Observation) -> SlipState:
        cues = self._contact.update(now.field, now.mask, now.load, blurred=now.blurred)
        imprint = now.imprint
        if self._contact.restarted and imprint and self._imprint and now.knows_load:
            imprint = self._imprint.restart()
        reliable = now.knows_contact or now.knows_load
        if reliable and cues.degree < self._machine.thresholds.incipient:
            # long shear or a rotation under the lights changes a sticking imprint as well
            imprint = None
        decisive, degree = self._with_imprint(cues.degree, imprint, reliable=reliable)
        self._machine.update(
            decisive, imprint.kind if imprint and self._slid(imprint) else _kind(cues), now.time_s
        )
        return SlipState(
            self._machine.name,
            degree,
            self._machine.kind,
            cues.entropy_bits,
            float(np.degrees(cues.rotation_rad)),
            self._machine.onset_s,
            now.time_s,
        )

    def _with_imprint(
        self, degree: float, imprint: ImprintMotion | None, *, reliable: bool
    ) -> tuple[float, float]:
        """The degree that determines the state, and the degree that is reported."""
        if imprint is None:
            return degree, degree
        slid = self._slid(imprint)
        if reliable:
            return 1.0 if slid else degree, degree
        decisive = 1.0 if slid else min(degree, self._warning_only)
        return decisive, max(SLIP.unknown_contact_weight * degree, imprint.degree)

    def _slid(self, imprint: ImprintMotion) -> bool:
        return imprint.lost >= self._imprint_lost

    def _forget(self) -> None:
        self._last = None
        self._contact.release()
        self._machine.reset()
        self._touch.release()

    def _imprint_motion(
        self, frame: Frame | None, reference: Reference | None, markers: MarkerField | None
    ) -> ImprintMotion | None:
        if (
            frame is None
            or markers is None
            or reference is None
            or self._markers is None
            or len(markers.ids) < VIEW.min_markers
        ):
            return None
        if self._imprint is None or self._imprint_of is not reference:
            undeformed_px = markers.undeformed_px
            undeformed_px = markers.reference_px if undeformed_px is None else undeformed_px
            self._imprint = ImprintTracker(
                reference.pixels, undeformed_px, self._markers.diameter_px
            )
            self._imprint_of = reference
        return self._imprint.update(frame.pixels, markers.px, frame.timestamp_s)


def _kind(cues: Cues) -> Kind:
    return "rotation" if 2 * cues.rotation_mm**2 > cues.motion_mm**2 else "translation"
