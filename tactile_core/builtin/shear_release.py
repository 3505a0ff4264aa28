"""Estimator ``core.shear_release``: how far the gel surface sprang back from its largest shear."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.slip.release import ShearPeak
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import MarkerField, ShearRelease


class ReleaseOfShear(Estimator):
    """Compare the shear of the markers with its largest recent value."""

    stateful = True
    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._peak = ShearPeak()

    def reset(self) -> None:
        """Forget all earlier shear."""
        self._peak.reset()

    def tare(self, result: ShearRelease) -> ShearRelease:
        """Measure from the present frame on."""
        self._peak.reset()
        return ShearRelease(result.shear_mm, 0.0, result.timestamp_s)

    def estimate(self, markers: MarkerField) -> ShearRelease:
        """Return the shear and its release; no shear if no marker is seen."""
        moved_px, count = markers.px - markers.reference_px, int(np.count_nonzero(markers.seen))
        if count < len(moved_px):
            moved_px = moved_px[markers.seen]
        square = float(np.vdot(moved_px, moved_px)) * markers.mm_per_px**2
        shear_mm = math.sqrt(square / count) if count else 0.0
        released = self._peak.update(shear_mm, markers.timestamp_s)
        return ShearRelease(shear_mm, released, markers.timestamp_s)
