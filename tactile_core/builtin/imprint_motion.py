"""Estimator ``core.imprint_motion``: motion of the object's imprint over the gel surface."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.slip.imprint_tracker import ImprintChange, ImprintTracker
from tactile_core.algorithms.slip.surface_view import VIEW
from tactile_core.conditioning.marker_mask import MarkerFinder
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactShear,
    Frame,
    ImprintMotion,
    MarkerField,
    Reference,
    SlipContact,
)


class MotionOfImprint(Estimator):
    """Track the imprint of the object relative to the gel surface.

    Pressing harder changes an imprint that sticks, so the measurement starts again when a known
    load grew.
    """

    stateful = True
    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._markers = None if context.gel.markers == "auto" else MarkerFinder.of(context)
        self._mm_per_px = context.image.mm_per_px
        self._tracker: ImprintTracker | None = None
        self._tracker_of: Reference | None = None

    def reset(self) -> None:
        """Forget the object."""
        if self._tracker is not None:
            self._tracker.reset()

    def tare(self, result: ImprintMotion) -> ImprintMotion:
        """Measure from the present frame on."""
        if self._tracker is None or not result.tracked:
            return result
        return _motion(self._tracker.restart(), result.timestamp_s)

    def estimate(
        self,
        frame: Frame,
        reference: Reference,
        markers: MarkerField,
        contact: SlipContact | None,
        shear: ContactShear | None,
    ) -> ImprintMotion:
        """Return the motion since the contact settled."""
        if self._markers is None or np.count_nonzero(markers.seen) < VIEW.min_markers:
            return ImprintMotion(False, timestamp_s=frame.timestamp_s)
        tracker = self._tracker_from(reference, markers, self._markers.diameter_px)
        halves = frame.halves if tracker.takes_halves else None
        change = tracker.update(frame.pixels, markers.px, frame.timestamp_s, halves)
        if shear is not None and shear.restarted and contact is not None and contact.absolute:
            change = tracker.restart()
        return _motion(change, frame.timestamp_s)

    def _tracker_from(
        self, reference: Reference, markers: MarkerField, diameter_px: float
    ) -> ImprintTracker:
        if self._tracker is None or not self._is_of(reference):
            undeformed_px = markers.undeformed_px
            undeformed_px = markers.reference_px if undeformed_px is None else undeformed_px
            self._tracker = ImprintTracker(
                reference.pixels,
                undeformed_px,
                diameter_px,
                self._mm_per_px,
            )
        self._tracker_of = reference
        return self._tracker

    def _is_of(self, reference: Reference) -> bool:
        """Whether the tracker was made for this reference, or for one with the same pixels."""
        of = self._tracker_of
        return of is reference or (of is not None and np.array_equal(of.pixels, reference.pixels))


def _motion(change: ImprintChange, time_s: float) -> ImprintMotion:
    return ImprintMotion(
        True,
        change.changed,
        change.moved,
        change.distance_mm,
        change.distance_std_mm,
        math.degrees(change.turned_rad),
        change.kind,
        change.strength,
        time_s,
    )
