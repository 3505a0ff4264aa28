"""The displacement of the skin at every pixel, from its markers."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.displacement import MarkedSurface
from tactile_core.algorithms.elasticity import POISSON_RATIO, THICKNESS_MM
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactMask, DisplacementField, MarkerField


class Displacement(Estimator):
    """Interpolates the markers as a layer of the gel's thickness moves.

    Where the contact is known, the field bends at its border as elasticity says; without it the
    bend is spread over the pitch of the markers. Markers that are not seen have no say.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._surface: MarkedSurface | None = None

    def estimate(self, markers: MarkerField, contact: ContactMask | None) -> DisplacementField:
        """Return the field; valid within a pitch of a marker that is seen."""
        surface = self._skin_of(markers)
        return DisplacementField(
            surface.cells(markers.px, markers.seen, None if contact is None else contact.mask),
            surface.supported(markers.px, markers.seen),
            markers.mm_per_px,
            markers.timestamp_s,
        )

    def _skin_of(self, markers: MarkerField) -> MarkedSurface:
        """The weights for these markers, which are kept: they cost far more than a frame."""
        kept = self._surface
        if kept is None or not np.array_equal(kept.reference_px, markers.reference_px):
            image, gel = self.context.image, self.context.gel
            kept = self._surface = MarkedSurface(
                markers.reference_px,
                (image.height_px, image.width_px),
                mm_per_px=markers.mm_per_px,
                thickness_mm=gel.thickness_mm or THICKNESS_MM,
                poisson_ratio=POISSON_RATIO if gel.poisson_ratio is None else gel.poisson_ratio,
            )
        return kept
