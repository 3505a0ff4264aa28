"""Cues of slip: the motion of the imprint, the loss of contact, friction."""

from __future__ import annotations

import math
from math import hypot
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.slip.contact_loss import ContactLossTracker, contact_strength
from tactile_core.algorithms.slip.imprint import VIEW
from tactile_core.algorithms.slip.imprint_tracker import ImprintChange, ImprintTracker
from tactile_core.algorithms.slip.marker_lattice import MarkerLattice
from tactile_core.algorithms.slip.state import FrictionRecord, friction_ratio, slip_margin
from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactLoss,
    ContactShear,
    Frame,
    Friction,
    ImprintMotion,
    MarkerField,
    Reference,
    SlipContact,
    SlipState,
    Wrench,
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
        self._markers = None if context.gel.markers == "auto" else MarkerFinder.for_gel(context)
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
        tracker = self._tracker_from(reference, markers, self._markers)
        halves = frame.halves if tracker.takes_halves else None
        change = tracker.update(frame.pixels, markers.px, frame.timestamp_s, halves)
        if shear is not None and shear.restarted and contact is not None and contact.absolute:
            change = tracker.restart()
        return _motion(change, frame.timestamp_s)

    def _tracker_from(
        self, reference: Reference, markers: MarkerField, finder: MarkerFinder
    ) -> ImprintTracker:
        if self._tracker is None or not self._is_of(reference):
            undeformed_px = markers.undeformed_px
            undeformed_px = markers.reference_px if undeformed_px is None else undeformed_px
            self._tracker = ImprintTracker(
                reference.pixels,
                undeformed_px,
                finder.diameter_px,
                self._mm_per_px,
                tone=finder.tone,
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


class LossOfContact(Estimator):
    """Follow the strength of a contact by the strain of a marker lattice and by the imprint.

    Neither needs an image of the undeformed surface. The markers have to form a square lattice;
    without one the loss is not measured.
    """

    stateful = True
    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._tracker = ContactLossTracker()
        self._lattice: MarkerLattice | None = None
        self._lattice_of = np.empty((0, 2), np.float32)

    def reset(self) -> None:
        """Forget the contact."""
        self._tracker.reset()
        self._lattice = None

    def estimate(self, markers: MarkerField, imprint: ImprintMotion | None) -> ContactLoss:
        """Return the strength of the contact and how much of it is lost."""
        time_s = markers.timestamp_s
        strain = self._lattice_in(markers).strain(markers.px, markers.seen, time_s)
        if strain is None or imprint is None or not imprint.tracked:
            return ContactLoss(False, timestamp_s=time_s)
        loss = self._tracker.update(contact_strength(strain, imprint.strength), time_s)
        return ContactLoss(True, loss.strength, loss.settled, loss.lost, time_s)

    def _lattice_in(self, markers: MarkerField) -> MarkerLattice:
        """Return the lattice of these markers: most often that of the frame before."""
        reference_px = markers.reference_px
        if self._lattice is None or not (
            self._lattice_of is reference_px or np.array_equal(self._lattice_of, reference_px)
        ):
            self._lattice = MarkerLattice(markers.px)
        self._lattice_of = reference_px
        return self._lattice


class FrictionEstimator(Estimator):
    """Measure the coefficient of friction while the contact slips, and the margin while it sticks.

    Before the first slip of a contact its coefficient is ``gel.friction`` of the profile, or what
    the contact has borne if that is larger.
    """

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._record = self._unknown

    @property
    def _unknown(self) -> FrictionRecord:
        return FrictionRecord(self.context.gel.friction)

    def reset(self) -> None:
        """Forget the contact."""
        self._record = self._unknown

    def estimate(self, slip: SlipState, wrench: Wrench) -> Friction:
        """Return the friction; nothing without contact or normal force."""
        std_n = wrench.fz_std_n or 0.0
        # [standard deviations] nearer to 0 the ratio has no mean
        if slip.state == "none" or wrench.fz_n <= 3.0 * std_n:
            self.reset()
            return Friction(timestamp_s=wrench.timestamp_s)
        ratio = friction_ratio(wrench.fx_n, wrench.fy_n, wrench.fz_n)
        # [share] of shear and normal force on virtual rigs (``experiments/elastic_force.py``)
        std = hypot(0.07 * ratio, (wrench.fx_std_n or 0.0) / wrench.fz_n)
        if slip.state == "slip" and slip.kind == "translation":
            self._record = self._record.slipping(ratio, std)
        elif slip.state in ("stick", "incipient"):
            self._record = self._record.sticking(ratio, std)
        coefficient = self._record.coefficient
        margin = None if coefficient is None else slip_margin(ratio, coefficient)
        return Friction(coefficient, self._record.std, margin, wrench.timestamp_s)
