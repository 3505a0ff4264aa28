"""Printed markers: detections in one frame, and tracked positions with identities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import FieldSpec, MmPerPx, TimestampS
from tactile_core.quantities.layers import Layer, Points
from tactile_core.quantities.quantity import Quantity

Int32 = NDArray[np.int32]
_EACH, _PLACES = ("marker",), ("marker", "xy")


_OUTRUN = (
    "markers moved further between two frames than they can be followed, so displacements may be "
    "wrong by their pitch; use a higher frame rate"
)


@dataclass(frozen=True, eq=False)
class MarkerDetections(Quantity):
    """The markers detected in one frame, unordered and without identities.

    Attributes
    ----------
    centres_px : (N, 2) float32
        x and y of each marker's centroid, in the image.
    truncated : (N,) bool
        The image border truncates the marker, so that its centre is an estimate and may be outside
        the image.
    """

    centres_px: Annotated[Float32, FieldSpec("px", _PLACES)]
    # files keep the name that they have had since the first version
    truncated: Annotated[Bool, FieldSpec(axes=_EACH, saved_as="MarkerDetections.cut")]
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class MarkerField(Quantity):
    """Current positions of all markers of the undeformed gel surface.

    Attributes
    ----------
    ids : (N,) int32
        A marker keeps its number as long as it is tracked.
    reference_px : (N, 2) float32
        x and y of each marker on the undeformed gel surface, or at the last tare.
    px : (N, 2) float32
        Current x and y of each marker; interpolated from its neighbours if it is not detected.
    seen : (N,) bool
        False if the position is interpolated from the neighbours.
    mm_per_px : float
    started_in_contact : bool
        Tracking began in contact. Either the reference shows a contact, and displacements are
        relative to that contact; or the first frame does, and identities are inferred from the
        deformation instead of being tracked.
    outrun : bool
        Markers moved further between two frames than they can be followed, and not all were found
        again since: identities and displacements may be wrong by a pitch.
    notes : tuple of str
        Messages to the user about this frame.
    undeformed_px : (N, 2) float32 or None
        x and y of each marker in the reference image, unaffected by tares; None if equal to
        ``reference_px``.
    """

    ids: Annotated[Int32, FieldSpec(axes=_EACH, saved_as="marker_ids")]
    reference_px: Annotated[Float32, FieldSpec("px", _PLACES, saved_as="marker_reference_px")]
    px: Annotated[Float32, FieldSpec("px", _PLACES, saved_as="markers_px")]
    seen: Annotated[Bool, FieldSpec(axes=_EACH, saved_as="marker_seen")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    started_in_contact: Annotated[bool, FieldSpec(saved_as="markers_started_in_contact")] = False
    outrun: Annotated[bool, FieldSpec(saved_as="markers_outrun")] = False
    notes: Annotated[tuple[str, ...], FieldSpec(saved_as="marker_notes")] = ()
    undeformed_px: Annotated[
        Float32 | None, FieldSpec("px", _PLACES, saved_as="marker_undeformed_px")
    ] = None

    @property
    def displacement_mm(self) -> Float32:
        """(N, 2) float32: displacement of each marker in mm, +x right, +y down."""
        return (self.px - self.reference_px) * np.float32(self.mm_per_px)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the fields and ``marker_displacement_mm``."""
        return {**super().arrays(), "marker_displacement_mm": self.displacement_mm}

    def layers(self) -> tuple[Layer, ...]:
        """Return the markers with arrows from their references; hollow if not seen."""
        return (Points(self.px, "markers", self.reference_px, self.seen),)

    def summary(self) -> Mapping[str, Any]:
        """Return the numbers of seen and expected markers."""
        return {"markers": {"seen": int(self.seen.sum()), "expected": len(self.ids)}}

    def warnings(self) -> tuple[str, ...]:
        """Return the notes, and what to do about markers that moved too far."""
        return (*self.notes, _OUTRUN) if self.outrun else self.notes
