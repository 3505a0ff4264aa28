"""``tactip.pins``: the pins of the undeformed sensor, found in every frame."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from tactile_core.algorithms.arrays.types import Array
from tactile_core.algorithms.markers.neighbourhood import Neighbourhood
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.interfaces.gel import Markers
from tactile_core.quantities import MarkerDetections, MarkerField, Reference
from tactile_tactip.matching import match_pins

_FEWEST = 12  # [count] Fewest pins with neighbours on all sides


class PinMatching(Estimator):
    """Match the pins of each frame with those of the undeformed sensor.

    Frames are independent, unlike those of ``core.marker_tracking``: a recording may jump from
    press to press, and processes may share it.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        markers = context.gel.markers
        self._count = markers.count if isinstance(markers, Markers) else None
        self._around: Neighbourhood | None = None
        self._detected = self._pins_px = np.zeros((0, 2), np.float32)

    def estimate(self, detections: MarkerDetections, reference: Reference) -> MarkerField:
        """Return the position of every pin.

        Raises
        ------
        InputError
            The reference does not show the pins of this sensor.
        """
        around = self._around_of(reference)
        px, seen = match_pins(around, self._pins_px, detections.centres_px)
        notes = []
        # [share] fewer were never seen on frames of the sensor, recorded or virtual
        if np.count_nonzero(seen) < 0.9 * len(seen):
            notes.append(
                f"only {np.count_nonzero(seen)} of {len(seen)} pins are found in this frame, which "
                f"shows {len(detections.centres_px)}; check that it is of this sensor and in focus"
            )
        return MarkerField(
            ids=np.arange(len(seen), dtype=np.int32),
            reference_px=self._pins_px,
            px=px.astype(np.float32),
            seen=seen,
            mm_per_px=self.context.image.mm_per_px,
            timestamp_s=detections.timestamp_s,
            notes=tuple(notes),
        )

    def _around_of(self, reference: Reference) -> Neighbourhood:
        """The neighbours of each pin in the reference, cached because they never change."""
        shown = reference.detections
        found = np.zeros((0, 2), np.float32) if shown is None else shown.centres_px
        if self._around is None or not np.array_equal(found, self._detected):
            self._detected, self._pins_px = found, self._choose_pins(found)
            self._around = Neighbourhood.from_places(self._pins_px.astype(np.float64))
        return self._around

    def _choose_pins(self, found_px: Array) -> Array:
        """Leave out what is farthest from the middle, where the rim of the dome is seen."""
        expected = _FEWEST if self._count is None else self._count
        if len(found_px) < expected:
            raise InputError(
                f"the reference shows {len(found_px)} pins, and this sensor has "
                f"{'at least ' if self._count is None else ''}{expected}; give --reference, one "
                f"of this sensor without contact, or correct 'gel.markers'"
            )
        if self._count is None:
            return found_px
        away = np.hypot(*(found_px - np.median(found_px, axis=0)).T)
        kept = np.sort(np.argsort(away, kind="stable")[: self._count])
        return found_px[kept]
