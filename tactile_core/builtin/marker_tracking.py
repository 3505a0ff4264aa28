"""Estimator ``core.marker_tracking``: the markers of the reference, tracked frame to frame."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from tactile_core.algorithms.marker_tracking import MarkerTracker, shows_contact
from tactile_core.algorithms.marker_tracking.parameters import GROWTH
from tactile_core.errors import InputError
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import MarkerDetections, MarkerField, Reference

Scalar = TypeVar("Scalar", bound=np.generic)

_IN_CONTACT = (
    "the {} shows the markers of a gel that is touched; for displacements from the undeformed "
    "surface, start without contact"
)


class MarkerTracking(Estimator):
    """Track the markers of the reference from frame to frame.

    A marker that is missing is not ``seen``; its position is inferred from its neighbours. See
    :class:`tactile_core.algorithms.marker_tracking.MarkerTracker`. Markers that the border of the
    reference truncates are tracked, because they help to identify the others, but not reported.
    """

    stateful = True
    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self.reset()

    def reset(self) -> None:
        """Forget the positions of the markers, and the tare."""
        self._tracker: MarkerTracker | None = None
        self._reported: NDArray[np.intp] = np.zeros(0, np.intp)
        self._all_reported = False
        self._ids = np.zeros(0, np.int32)
        self._zero_px: NDArray[np.float32] = np.zeros((0, 2), np.float32)
        self._undeformed_px = self._zero_px
        self._before_px = self._undeformed_px, self._zero_px
        self._contact_in_reference = False

    def resume(self) -> None:
        """Forget the positions of the markers, but keep the tare for the same reference."""
        before_px = self._undeformed_px, self._zero_px
        if self._tracker is not None:
            self.reset()
            self._before_px = before_px

    def tare(self, result: MarkerField) -> MarkerField:
        """Measure displacements from the present positions of the markers."""
        self._zero_px = result.px
        return replace(result, reference_px=result.px)

    def estimate(self, detections: MarkerDetections, reference: Reference) -> MarkerField:
        """Return the present position of every marker of the reference.

        Raises
        ------
        InputError
            The reference shows fewer than four markers.
        """
        tracker = self._tracker or self._begin(reference)
        first = tracker.began_displaced is None
        tracker.update(detections.centres_px)
        started_in_contact = self._contact_in_reference or bool(tracker.began_displaced)
        notes = []
        if tracker.lost:
            notes.append(
                f"none of the {len(self._reported)} markers can be identified in this frame, which "
                f"shows {len(detections.centres_px)}; their positions are those of an earlier one"
            )
        if tracker.outrun_pitches:
            notes.append(
                f"markers moved by {tracker.outrun_pitches:.2f} of their pitch or more from one "
                f"frame to the next, too far to be followed, so displacements may be wrong until "
                f"they are found again; use a higher frame rate, or move more slowly"
            )
        if first and started_in_contact:
            notes.append(
                _IN_CONTACT.format("reference" if self._contact_in_reference else "first frame")
            )
        return MarkerField(
            ids=self._ids,
            reference_px=self._zero_px,
            px=self._positions_px(),
            seen=tracker.seen if self._all_reported else tracker.seen[self._reported],
            mm_per_px=self.context.image.mm_per_px,
            timestamp_s=detections.timestamp_s,
            started_in_contact=started_in_contact,
            notes=tuple(notes),
            outrun=bool(tracker.outrun_pitches),
            undeformed_px=self._undeformed_px,
        )

    def _begin(self, reference: Reference) -> MarkerTracker:
        undeformed = reference.detections
        count = 0 if undeformed is None else len(undeformed.centres_px)
        if undeformed is None or count < GROWTH.min_markers:
            raise InputError(
                f"the reference shows {count} markers, too few to track; record it without "
                f"contact, in focus and evenly lit, or set 'gel.markers: null' for a gel without "
                f"markers"
            )
        self._tracker = MarkerTracker(undeformed.centres_px)
        self._reported = np.flatnonzero(~undeformed.truncated)
        self._all_reported = len(self._reported) == count
        self._ids = _constant(np.arange(len(self._reported), dtype=np.int32))
        self._zero_px = self._undeformed_px = _constant(self._positions_px())
        if np.array_equal(self._before_px[0], self._undeformed_px):
            self._zero_px = self._before_px[1]
        self._contact_in_reference = shows_contact(undeformed.centres_px)
        return self._tracker

    def _positions_px(self) -> NDArray[np.float32]:
        assert self._tracker is not None
        px = self._tracker.px
        return (px if self._all_reported else px[self._reported]).astype(np.float32)


def _constant(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """Return an array that every result may share, so that other steps find it unchanged."""
    array.flags.writeable = False
    return array
