"""Whether the contact sticks, begins to slip or slips."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.arrays.types import Bool, Complex64
from tactile_core.algorithms.slip.cues import Cues
from tactile_core.algorithms.slip.imprint import SLIP_SHARE, ImprintFollower, ImprintMotion
from tactile_core.algorithms.slip.plane import coarse, stride_of
from tactile_core.algorithms.slip.sheared_contact import Load, ShearedContact
from tactile_core.algorithms.slip.state import Kind, SlipMachine, Thresholds
from tactile_core.algorithms.slip.stick_region import NOISE_MM
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

_FEWEST_MARKERS = 3
_UNSURE = 0.2
"""Without a known contact the field's degree stays under that of an imprint that slips."""

_ENOUGH_MEASURED = 12
"""Places with a displacement that is not extended beyond the markers."""


class _Held(NamedTuple):
    """What one frame shows of a contact."""

    field: Complex64
    mask: Bool
    load: Load
    blurred: bool
    imprint: ImprintMotion | None
    knows_contact: bool
    knows_load: bool
    time_s: float


class Slip(Estimator):
    """How much of the contact still follows its sticking core, and whether that halts.

    The contact lies within what is steep in the height map where there is one, else within what
    changes in the image, else it is the skin that is dragged along. Where markers and frames are
    there, the object's imprint is followed over the skin, too: once the field warns, an imprint
    that leaves its place tells that all slips. Without a height map and with no picture of the
    untouched skin the imprint alone tells gross slip, and the field warns.
    """

    class Options(device.Options):
        """Options of the step.

        The degrees' source is ``benchmarks/slip_thresholds.py``.
        """

        window_mm: PositiveFloat = Field(
            default=0.1, description="Slip is told over the last motion of the skin by so much."
        )
        tolerance: float = Field(
            default=0.1,
            gt=0,
            lt=1,
            description="The skin follows its core if it lags by less than this share of its "
            "way; twice that where the contact is told from the image.",
        )
        noise_mm: PositiveFloat = Field(
            default=NOISE_MM, description="Of a displacement along x or y."
        )
        incipient: float = Field(
            default=0.28, ge=0, le=1, description="Degree at which slip begins at the border."
        )
        incipient_ends: float = Field(
            default=0.19, ge=0, le=1, description="Degree under which the contact sticks again."
        )
        slip: float = Field(default=0.43, ge=0, le=1, description="Degree at which all slips.")
        slip_ends: float = Field(
            default=0.35, ge=0, le=1, description="Degree under which part of it sticks again."
        )
        imprint_lost: PositiveFloat = Field(
            default=SLIP_SHARE,
            description="Share of the imprint that leaves its place on the gel surface in gross "
            "slip; chosen on recorded lifts (docs/reference/accuracy.md).",
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
        self._imprint: ImprintFollower | None = None
        self._imprint_of: Reference | None = None
        self._held: _Held | None = None
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._forget()
        self._touch.reset()
        if self._imprint is not None:
            self._imprint.reset()

    def tare(self, result: SlipState) -> SlipState:
        """Slip is told from now on."""
        self._contact.release()
        if self._held is None:
            return result
        followed = self._imprint is not None and self._held.imprint is not None
        imprint = self._imprint.settle() if self._imprint is not None and followed else None
        return self._state(self._held._replace(imprint=imprint))

    def estimate(
        self,
        displacement: DisplacementField,
        frame: Frame | None,
        reference: Reference | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> SlipState:
        """Return the state; ``none`` where nothing touches."""
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
            if not self._gone(imprint):
                return SlipState("none", imprint.degree, timestamp_s=time_s)
            return SlipState("slip", imprint.degree, imprint.kind, timestamp_s=time_s)
        valid = mask & self._touch.picked(displacement.valid)
        if np.count_nonzero(valid) >= _ENOUGH_MEASURED:
            mask = valid
        # against a first frame that may show a contact, neither it nor its load is known
        knows_load = reference is not None and not reference.relative
        self._held = _Held(
            field, mask, load, blurred, imprint, contact is not None, knows_load, time_s
        )
        return self._state(self._held)

    def _state(self, held: _Held) -> SlipState:
        cues = self._contact.update(held.field, held.mask, held.load, blurred=held.blurred)
        imprint = held.imprint
        if self._contact.began and imprint and self._imprint and held.knows_load:
            imprint = self._imprint.settle()
        sure = held.knows_contact or held.knows_load
        if sure and cues.degree < self._machine.thresholds.incipient:
            # what is held but dragged far, or turned under its lamps, looks different, too
            imprint = None
        told, degree = self._with_imprint(cues.degree, imprint, sure=sure)
        self._machine.update(
            told, imprint.kind if imprint and self._gone(imprint) else _kind(cues), held.time_s
        )
        return SlipState(
            self._machine.name,
            degree,
            self._machine.kind,
            cues.entropy_bits,
            float(np.degrees(cues.turn_rad)),
            self._machine.onset_s,
            held.time_s,
        )

    def _with_imprint(
        self, degree: float, imprint: ImprintMotion | None, *, sure: bool
    ) -> tuple[float, float]:
        """What decides on the state, and the degree that is told."""
        if imprint is None:
            return degree, degree
        gone = self._gone(imprint)
        if sure:
            return 1.0 if gone else degree, degree
        told = 1.0 if gone else min(degree, self._warning_only)
        return told, max(_UNSURE * degree, imprint.degree)

    def _gone(self, imprint: ImprintMotion) -> bool:
        return imprint.lost >= self._imprint_lost

    def _forget(self) -> None:
        self._held = None
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
            or len(markers.ids) < _FEWEST_MARKERS
        ):
            return None
        if self._imprint is None or self._imprint_of is not reference:
            rest_px = markers.undeformed_px
            rest_px = markers.reference_px if rest_px is None else rest_px
            self._imprint = ImprintFollower(reference.pixels, rest_px, self._markers.diameter_px)
            self._imprint_of = reference
        return self._imprint.update(frame.pixels, markers.px, frame.timestamp_s)


def _kind(cues: Cues) -> Kind:
    return "rotation" if 2 * cues.turned_mm**2 > cues.motion_mm**2 else "translation"
