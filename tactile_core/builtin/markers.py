"""Where the printed marks are in a frame."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.conditioning.marker_mask import MarkFinder
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import Frame, MarkerDetections


class MarkerDetection(Estimator):
    """Finds round, square and triangular marks, each by itself; see :func:`find_markers
    <tactile_core.algorithms.markers.find_markers>` for the method.

    Which mark is which is told by the step that follows them.
    """

    needs_marks: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        if context.gel.markers == "auto":
            raise InputError(
                "'gel.markers: auto' finds no lattice of marks in the reference; say their "
                "{pitch_mm: …, diameter_mm: …}, or 'markers: null' if none are printed"
            )
        self._finder = MarkFinder.of(context)

    def estimate(self, frame: Frame) -> MarkerDetections:
        """Return the centroids of all marks in view; none are reported where they are not seen."""
        if self._finder is None:
            nothing = np.zeros((0, 2), np.float32), np.zeros(0, np.bool_)
            return MarkerDetections(*nothing, frame.timestamp_s)
        return self._finder.detect(frame, compiled=self.context.compiled)
