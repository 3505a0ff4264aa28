"""Adapters: ``core.contact``, ``core.displacement``, ``core.load``, markers and their tracking."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, NonNegativeFloat, PositiveFloat

from tactile_core.algorithms.contact import contact_mask
from tactile_core.algorithms.displacement.marked_surface import MarkedSurface
from tactile_core.algorithms.force.elastic_layer import POISSON_RATIO, THICKNESS_MM
from tactile_core.algorithms.light.light_change import change_in_detail
from tactile_core.algorithms.markers.neighbourhood import GROWTH, shows_contact
from tactile_core.algorithms.markers.tracker import MarkerTracker
from tactile_core.conditioning.marker_finder import MarkerFinder
from tactile_core.errors import InputError
from tactile_core.interfaces import device
from tactile_core.interfaces.estimator import Estimator, SensorContext
from tactile_core.quantities import (
    Bool,
    ContactMask,
    DisplacementField,
    Frame,
    HeightMap,
    MarkerDetections,
    MarkerField,
    Reference,
    RelativeLoad,
)
from tactile_core.quantities.quantity import grid_of, on_demand


class Contact(Estimator):
    """Segments regions that are deep, steep and large enough to be a contact."""

    class Options(device.Options):
        """Options of the step."""

        min_indentation_mm: NonNegativeFloat = Field(
            default=0.03,
            description="Least depth of a contact, mm, or 5 times the noise if that is more.",
        )
        border_fraction: float | None = Field(
            default=None,
            ge=0,
            lt=1,
            description="Depth at the border over the greatest depth. Default: from the slopes.",
        )
        min_slope: NonNegativeFloat = Field(
            default=0.1,
            description="Least slope of the flank of a contact, dimensionless, or 5 times the "
            "noise if that is more.",
        )
        min_area_mm2: PositiveFloat = Field(
            default=0.05, description="Least area of a contact, mm²; smaller regions are specks."
        )

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._thresholds = options.model_dump()

    def estimate(self, height: HeightMap) -> ContactMask:
        """Return the contact mask; all False when nothing touches."""
        grid = grid_of(height, "mm").of_image()
        mask = contact_mask(
            grid.cells,
            step_px=grid.step_px,
            mm_per_px=height.mm_per_px,
            **self._thresholds,
        )
        return ContactMask(mask, height.mm_per_px, height.timestamp_s)


class Displacement(Estimator):
    """Interpolate the displacements of markers to every pixel.

    With a known contact area the field bends sharply at its border, as an elastic layer does.
    Without it the bend is spread over the marker pitch. Unseen markers are ignored. The method is
    :class:`tactile_core.algorithms.displacement.marked_surface.MarkedSurface`.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        self._surface: MarkedSurface | None = None

    def estimate(self, markers: MarkerField, contact: ContactMask | None) -> DisplacementField:
        """Return the field; valid within a pitch of a marker that is seen."""
        surface = self._surface_of(markers)
        area = None if contact is None else contact.mask
        field = surface.measure_field(markers.px, markers.seen, area)
        return DisplacementField(
            field.cells_mm,
            surface.find_valid_area(markers.px, markers.seen),
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


# [share of the image's width] Thickness of a gel whose profile does not give it. Source: the
# gel of the hexagonal fingertip, 2 mm in a view of 17.67 mm.
THICKNESS_SHARE = 0.11


class Load(Estimator):
    """Measure how much the light of the gel surface changed from the reference.

    It needs neither calibration nor markers, and works with any number of channels. The load grows
    with normal force; how fast depends on the sensor and on the size and shape of the object.
    """

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        image, thickness_mm = context.image, context.gel.thickness_mm
        self._thickness_px = THICKNESS_SHARE * image.width_px
        if thickness_mm is not None:
            self._thickness_px = thickness_mm / image.mm_per_px
        self._zero = self._last = 0.0

    def reset(self) -> None:
        """Forget the tare."""
        self._zero = self._last = 0.0

    def tare(self, result: RelativeLoad) -> RelativeLoad:
        """Subtract the present load from all later ones."""
        self._zero = self._last
        return RelativeLoad(0.0, result.timestamp_s)

    def estimate(self, frame: Frame, reference: Reference) -> RelativeLoad:
        """Return the load relative to the reference."""
        hidden = _join_masks(frame.marker_mask, reference.marker_mask)
        self._last = change_in_detail(frame.pixels, reference.pixels, hidden, self._thickness_px)
        return RelativeLoad(self._last - self._zero, frame.timestamp_s)


def _join_masks(now: Bool | None, before: Bool | None) -> Bool | None:
    """Pixels that a marker covers in either image."""
    if now is None or before is None:
        return before if now is None else now
    return now | before


class MarkerDetection(Estimator):
    """Detect dark or bright markers of any compact shape in a single frame.

    The method is :func:`~tactile_core.algorithms.markers.detection.find_markers`. Detections have
    no identity; the tracking step assigns it.
    """

    needs_markers: ClassVar[bool] = True

    def __init__(self, options: BaseModel, context: SensorContext) -> None:
        super().__init__(options, context)
        if context.gel.markers == "auto":
            raise InputError(
                "'gel.markers: auto' finds no lattice of markers in the reference; give their "
                "{pitch_mm: …, diameter_mm: …}, with 'tone: bright' if they are brighter than "
                "the gel, or 'markers: null' if none are printed"
            )
        self._finder = MarkerFinder.for_gel(context)

    def estimate(self, frame: Frame) -> MarkerDetections:
        """Return the centroids of all markers in view, or none if the gel has no markers."""
        if self._finder is None:
            nothing = np.zeros((0, 2), np.float32), np.zeros(0, np.bool_)
            return MarkerDetections(*nothing, frame.timestamp_s)
        return self._finder.detect(frame)


Scalar = TypeVar("Scalar", bound=np.generic)

_IN_CONTACT = (
    "the {} shows the markers of a gel that is touched; for displacements from the undeformed "
    "surface, start without contact"
)


class MarkerTracking(Estimator):
    """Track the markers of the reference from frame to frame.

    A marker that is missing is not ``seen``; its position is inferred from its neighbours. See
    :class:`tactile_core.algorithms.markers.tracker.MarkerTracker`. Markers that the border of the
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
