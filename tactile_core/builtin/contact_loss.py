"""Estimator ``core.contact_loss``: a contact that grows weaker than it settled."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.slip.contact_loss import ContactLossTracker, contact_strength
from tactile_core.algorithms.slip.marker_lattice import MarkerLattice
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactLoss, ImprintMotion, MarkerField


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
