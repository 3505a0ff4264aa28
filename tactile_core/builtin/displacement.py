"""Estimator ``core.displacement``: the dense displacement of the gel surface, from markers."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.displacement import MarkedSurface
from tactile_core.algorithms.elasticity import POISSON_RATIO, THICKNESS_MM
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import ContactMask, DisplacementField, MarkerField
from tactile_core.quantities.on_demand import on_demand


class Displacement(Estimator):
    """Interpolate the displacements of markers to every pixel.

    With a known contact area the field bends sharply at its border, as an elastic layer does.
    Without it the bend is spread over the marker pitch. Unseen markers are ignored. The method is
    :class:`tactile_core.algorithms.displacement.MarkedSurface`.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._surface: MarkedSurface | None = None

    def estimate(self, markers: MarkerField, contact: ContactMask | None) -> DisplacementField:
        """Return the field; valid within a pitch of a marker that is seen."""
        surface = self._surface_of(markers)
        area = None if contact is None else contact.mask
        field = surface.measured(markers.px, markers.seen, area)
        return DisplacementField(
            field.cells_mm,
            surface.supported(markers.px, markers.seen),
            markers.mm_per_px,
            markers.timestamp_s,
            on_demand(lambda: field.std_cells_mm),
        )

    def _surface_of(self, markers: MarkerField) -> MarkedSurface:
        """The interpolation weights of these markers, cached because they are expensive."""
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
