"""Estimator ``core.markers``: the printed markers in each frame."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.conditioning.marker_mask import ONLY_DARK, MarkerFinder
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Frame, MarkerDetections


class MarkerDetection(Estimator):
    """Detect round, square and triangular markers in a single frame.

    The method is :func:`find_markers <tactile_core.algorithms.markers.find_markers>`. Detections
    have no identity; the tracking step assigns it.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        if context.gel.markers == "auto":
            raise InputError(
                f"'gel.markers: auto' finds no lattice of markers in the reference; give their "
                f"{{pitch_mm: …, diameter_mm: …}}, or 'markers: null' if none are printed "
                f"({ONLY_DARK})"
            )
        self._finder = MarkerFinder.of(context)

    def estimate(self, frame: Frame) -> MarkerDetections:
        """Return the centroids of all markers in view, or none if the gel has no markers."""
        if self._finder is None:
            nothing = np.zeros((0, 2), np.float32), np.zeros(0, np.bool_)
            return MarkerDetections(*nothing, frame.timestamp_s)
        return self._finder.detect(frame)
