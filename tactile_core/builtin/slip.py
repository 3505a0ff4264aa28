"""Estimator ``core.slip``: whether the contact sticks, slips incipiently or slips."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, Field, PositiveFloat

from tactile_core.algorithms.slip.contact_loss import CONTACT_LOSS
from tactile_core.algorithms.slip.state import (
    FUSION,
    SlipMachine,
    Thresholds,
    degree_of,
)
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    ContactLoss,
    ContactShear,
    Frame,
    ImprintMotion,
    MarkerField,
    SlipContact,
    SlipState,
)
from tactile_core.quantities.quantity import grid_of

_UNSEEN = "neither markers nor texture show how the gel surface moves"
_UNSETTLED = "the load is not known, and no contact has settled yet"

_UNRELATED = (
    "it shows in motion, and these images are unrelated to each other; give a video, a recording, "
    "or images whose names are times"
)
# Why the state is unknown though there is evidence.
_OUTRUN = "markers moved further between two frames than they can be followed"


class _Verdict(NamedTuple):
    """The degree that determines the state, and the degree that is reported."""

    decisive: float
    degree: float


class Slip(Estimator):
    """Fuse the evidence of slip.

    Where the contact or the load is known, the shear of the contact gives the degree, and an
    imprint that moves means gross slip once the shear warns of it: a long shear under the lights
    changes an imprint that sticks as well. Where neither is known, only the imprint proves gross
    slip, and the shear warns; but where the loss of contact is measured, only it proves gross slip,
    and the imprint warns. Without usable markers or flow, and before a contact settled whose load
    is not known, the state is unknown.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
       GelSight tactile sensor", ICRA, 2015.
    """

    class Options(device.Options):
        """Options of the step.

        The degrees are shares of the contact that slips: half of it, and nearly all. Both end at
        lower shares against noise; ``benchmarks/slip_thresholds.py`` scores them.
        """

        incipient: float = Field(
            default=0.5, ge=0, le=1, description="Degree at which incipient slip begins."
        )
        incipient_ends: float = Field(
            default=0.25, ge=0, le=1, description="Degree below which the contact sticks again."
        )
        slip: float = Field(
            default=0.9, ge=0, le=1, description="Degree at which gross slip begins."
        )
        slip_ends: float = Field(
            default=0.75, ge=0, le=1, description="Degree below which gross slip ends."
        )
        imprint_changed: PositiveFloat = Field(
            default=FUSION.imprint_changed,
            description="Share of the imprint that changed without explanation in gross slip; "
            "chosen on recorded lifts (docs/reference/accuracy.md).",
        )

    stateful = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        chosen = self.Options.model_validate(options.model_dump())
        self._machine = SlipMachine(
            Thresholds(
                incipient=chosen.incipient,
                incipient_ends=chosen.incipient_ends,
                slip=chosen.slip,
                slip_ends=chosen.slip_ends,
            )
        )
        self._warning_only = float(np.nextafter(chosen.slip, 0))
        self._imprint_changed = chosen.imprint_changed

    def reset(self) -> None:
        """Forget the contact."""
        self._machine.reset()

    def estimate(
        self,
        contact: SlipContact,
        shear: ContactShear | None,
        imprint: ImprintMotion | None,
        loss: ContactLoss | None,
        frame: Frame | None = None,
        markers: MarkerField | None = None,
    ) -> SlipState:
        """Return the state; ``none`` without contact, ``unknown`` without evidence."""
        found = self._fuse_cues(contact, shear, imprint, loss)
        if found.state == "none" and contact.known:
            return found
        if frame is not None and frame.standalone:
            self._machine.reset()
            return SlipState("unknown", 0.0, timestamp_s=found.timestamp_s, reason=_UNRELATED)
        if markers is not None and markers.outrun and found.state != "none":
            return replace(found, state="unknown", kind=None, onset_s=None, reason=_OUTRUN)
        return found

    def _fuse_cues(
        self,
        contact: SlipContact,
        shear: ContactShear | None,
        imprint: ImprintMotion | None,
        loss: ContactLoss | None,
    ) -> SlipState:
        time_s = contact.timestamp_s
        shear = shear if shear is not None and shear.usable else None
        imprint = imprint if imprint is not None and imprint.tracked else None
        evidence = self._evidence(imprint, contact)
        touched = bool(np.count_nonzero(grid_of(contact, "mask").cells))
        if shear is None and imprint is None and (touched or contact.source != "height"):
            self._machine.reset()
            return SlipState("unknown", 0.0, timestamp_s=time_s, reason=_UNSEEN)
        if loss is not None and loss.measured and not contact.known:
            return self._by_loss(loss, shear, imprint, evidence, touched=touched)
        if not touched and (contact.known or evidence < 1):
            self._machine.reset()
            degree = 0.0 if contact.known else degree_of(evidence)
            return SlipState("none", degree, timestamp_s=time_s)
        decisive, degree = self._verdict(contact, shear, evidence, tracked=imprint is not None)
        kind = shear.kind if shear is not None else "translation"
        if imprint is not None and (imprint.moved >= 1 or shear is None):
            kind = imprint.kind
        self._machine.update(decisive, kind, time_s)
        return self._state(degree, shear, imprint, time_s)

    def _state(
        self,
        degree: float,
        shear: ContactShear | None,
        imprint: ImprintMotion | None,
        time_s: float,
    ) -> SlipState:
        return SlipState(
            self._machine.name,
            degree,
            self._machine.kind,
            None if shear is None else shear.entropy_bits,
            None if shear is None else shear.rotation_deg,
            self._machine.onset_s,
            None if imprint is None else imprint.distance_mm,
            None if imprint is None else imprint.distance_std_mm,
            time_s,
        )

    def _by_loss(
        self,
        loss: ContactLoss,
        shear: ContactShear | None,
        imprint: ImprintMotion | None,
        evidence: float,
        *,
        touched: bool,
    ) -> SlipState:
        """Return the state of a contact whose load is not known, from how much of it is lost."""
        if loss.settled < CONTACT_LOSS.weakest:
            self._machine.reset()
            if not touched:
                return SlipState("none", loss.lost, timestamp_s=loss.timestamp_s)
            return SlipState("unknown", loss.lost, timestamp_s=loss.timestamp_s, reason=_UNSETTLED)
        field = 0.0 if shear is None else shear.degree
        warning = min(self._warning_only, 1.0 if evidence >= 1 else field)
        kind = imprint.kind if imprint is not None and evidence >= 1 else "translation"
        slips = loss.lost >= CONTACT_LOSS.lost_share
        self._machine.update(1.0 if slips else warning, kind, loss.timestamp_s)
        return self._state(loss.lost, shear, imprint, loss.timestamp_s)

    def _evidence(self, imprint: ImprintMotion | None, contact: SlipContact) -> float:
        """Evidence of gross slip from the imprint; from 1 on the object slips.

        Under a known contact a change alone is none: on a smooth object that is sheared far, only
        the light changes.
        """
        if imprint is None:
            return 0.0
        changed = 0.0 if contact.known else imprint.changed / self._imprint_changed
        return max(changed, imprint.moved)

    def _verdict(
        self, contact: SlipContact, shear: ContactShear | None, evidence: float, *, tracked: bool
    ) -> _Verdict:
        of_imprint = degree_of(evidence)
        if shear is None:
            return _Verdict(1.0 if evidence >= 1 else 0.0, of_imprint)
        if contact.known:
            warned = shear.degree >= self._machine.thresholds.incipient
            return _Verdict(1.0 if warned and evidence >= 1 else shear.degree, shear.degree)
        if not tracked:
            return _Verdict(shear.degree, shear.degree)
        decisive = 1.0 if evidence >= 1 else min(shear.degree, self._warning_only)
        # the field ranks recorded lifts wrongly where contact and load are unknown (ADR 29)
        return _Verdict(decisive, of_imprint)
