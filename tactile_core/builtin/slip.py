"""Whether the contact sticks, begins to slip or slips."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core import device
from tactile_core.algorithms.markers import find_marker_diameter
from tactile_core.algorithms.quantile import quantile
from tactile_core.algorithms.slip.core import NOISE_MM
from tactile_core.algorithms.slip.drag import Cues, DraggedContact, Load
from tactile_core.algorithms.slip.imprint import SLIP_SHARE, ImprintFollower, ImprintMotion
from tactile_core.algorithms.slip.plane import coarse, stride_of
from tactile_core.algorithms.slip.state import Kind, SlipMachine, Thresholds
from tactile_core.algorithms.slip.touched import small_image, touched_by_image, touched_by_motion
from tactile_core.estimator import Estimator, SensorContext
from tactile_core.profiles.model import Markers
from tactile_core.quantities import (
    ContactMask,
    DisplacementField,
    Frame,
    HeightMap,
    MarkerField,
    Reference,
    SlipState,
)

Bool = NDArray[np.bool_]

_DRAGGED_MM = 0.04
_FEWEST_MARKS = 3
_UNSURE = 0.4
"""Without a measured contact the field's degree stays under that of an imprint that slips."""

_ENOUGH_MEASURED = 12
"""Places with a displacement that is not extended beyond the marks."""


class Slip(Estimator):
    """How much of the contact still follows its sticking core, and whether the skin halts.

    The contact is that of the height map where there is one, else what changes in the image, else
    the skin that is dragged along. Where marks and frames are there, the object's imprint is
    followed over the skin, too: what leaves its place slips. Without a contact from a height map
    the imprint alone tells gross slip, and the field warns.
    """

    class Options(device.Options):
        """Options of the step; the thresholds' source is ``benchmarks/slip_thresholds.py``."""

        window_mm: PositiveFloat = Field(
            default=0.06, description="Slip is told over the last motion of the skin by so much."
        )
        tolerance: float = Field(
            default=0.2,
            gt=0,
            lt=1,
            description="The skin follows its core if it lags by less than this share of its way.",
        )
        noise_mm: PositiveFloat = Field(
            default=NOISE_MM, description="Of a displacement along x or y."
        )
        incipient: float = Field(
            default=0.45, ge=0, le=1, description="Degree at which slip begins at the border."
        )
        incipient_ends: float = Field(
            default=0.33, ge=0, le=1, description="Degree under which the contact sticks again."
        )
        slip: float = Field(default=0.59, ge=0, le=1, description="Degree at which all slips.")
        slip_ends: float = Field(
            default=0.47, ge=0, le=1, description="Degree under which part of it sticks again."
        )
        imprint_lost: PositiveFloat = Field(
            default=SLIP_SHARE,
            description="Share of the imprint that leaves its place on the skin in gross slip; "
            "its source is benchmarks/slip_recordings.py.",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        chosen = self.Options.model_validate(options.model_dump())
        self._stride = stride_of(context.image.width_px)
        spacing_mm = self._stride * context.image.mm_per_px
        self._contact = DraggedContact(
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
        self._untouched: NDArray[np.float32] | None = None
        self._imprint: ImprintFollower | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the contact."""
        self._forget()
        if self._imprint is not None:
            self._imprint.reset()

    def tare(self) -> None:
        """Slip is told from now on."""
        self._contact.release()

    def estimate(
        self,
        displacement: DisplacementField,
        frame: Frame | None,
        markers: MarkerField | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> SlipState:
        """Return the state; ``none`` where nothing touches."""
        time_s = displacement.timestamp_s
        imprint = self._imprint_motion(frame, markers)
        gone = imprint is not None and imprint.lost >= self._imprint_lost
        field = coarse(displacement.mm, self._stride)
        mask, load = self._touched(np.abs(field), frame, height, contact)
        if not mask.any():
            self._forget()
            if imprint is None or not gone:
                return SlipState("none", imprint.degree if imprint else 0.0, timestamp_s=time_s)
            return SlipState("slip", imprint.degree, imprint.kind, timestamp_s=time_s)
        measured = mask & self._picked(displacement.valid)
        if np.count_nonzero(measured) >= _ENOUGH_MEASURED:
            mask = measured
        cues = self._contact.update(field, mask, load)
        told = degree = cues.degree
        if imprint is not None:
            sure = contact is not None
            told = 1.0 if gone else told if sure else min(told, self._warning_only)
            degree = max(
                degree if sure else _UNSURE * degree, imprint.degree if gone or not sure else 0
            )
        self._machine.update(told, imprint.kind if imprint and gone else _kind(cues), time_s)
        return SlipState(
            self._machine.name,
            degree,
            self._machine.kind,
            cues.entropy_bits,
            float(np.degrees(cues.turn_rad)),
            self._machine.onset_s,
            time_s,
        )

    def _forget(self) -> None:
        self._contact.release()
        self._machine.reset()
        self._dragged: Bool | None = None
        self._known = False

    def _imprint_motion(
        self, frame: Frame | None, markers: MarkerField | None
    ) -> ImprintMotion | None:
        reference = self.context.reference
        if (
            frame is None
            or markers is None
            or reference is None
            or len(markers.ids) < _FEWEST_MARKS
        ):
            return None
        if self._imprint is None:
            diameter_px = self._diameter_px(reference)
            if diameter_px is None:
                return None
            self._imprint = ImprintFollower(reference.pixels, markers.reference_px, diameter_px)
        return self._imprint.update(frame.pixels, markers.px, frame.timestamp_s)

    def _diameter_px(self, reference: Reference) -> float | None:
        told = self.context.gel.markers
        if isinstance(told, Markers):
            return told.diameter_mm / self.context.image.mm_per_px
        found = find_marker_diameter(reference.pixels)
        return None if found is None else found[0]

    def _touched(
        self,
        moved_mm: NDArray[np.float32],
        frame: Frame | None,
        height: HeightMap | None,
        contact: ContactMask | None,
    ) -> tuple[Bool, Load]:
        if contact is not None and (contact.mask.any() or not self._fills_view(moved_mm)):
            mask = self._picked(contact.mask)
            self._known = bool(mask.any())
            depth = float(self._picked(height.mm)[mask].sum()) if height is not None else 0.0
            return mask, Load(float(np.count_nonzero(contact.mask)), depth)
        if contact is None and frame is not None and self.context.reference is not None:
            mask, strength = self._touched_by_image(frame, moved_mm.shape)
            if mask.any():
                return mask, Load(0.0, strength)
        mask = touched_by_motion(moved_mm)
        if mask.any() and self._dragged is not None:
            # what lags behind when slip begins was dragged along before
            mask |= self._dragged
        self._dragged = mask if mask.any() else None
        return mask, Load(float(np.count_nonzero(mask)), 0.0)

    def _fills_view(self, moved_mm: NDArray[np.float32]) -> bool:
        """A level object larger than the view has no slopes to be seen by, but drags the skin."""
        return not self._known and quantile(moved_mm.ravel(), 0.5) > _DRAGGED_MM

    def _touched_by_image(self, frame: Frame, shape: tuple[int, ...]) -> tuple[Bool, float]:
        reference = self.context.reference
        assert reference is not None
        size_px = shape[1], shape[0]
        if self._untouched is None:
            self._untouched = small_image(reference.pixels, size_px, reference.full_scale)
        now = small_image(frame.pixels, size_px, frame.full_scale)
        return touched_by_image(now, self._untouched, reference.noise / reference.full_scale)

    def _picked(self, image: NDArray[Any]) -> NDArray[Any]:
        first = self._stride // 2
        return image[first :: self._stride, first :: self._stride]


def _kind(cues: Cues) -> Kind:
    return "rotation" if 2 * cues.turned_mm**2 > cues.motion_mm**2 else "translation"
