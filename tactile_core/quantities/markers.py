"""Markers, and the displacement of the gel surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Bool, Float32
from tactile_core.quantities.fields import FieldSpec, Layer, MmPerPx, Points, TimestampS, VectorMap
from tactile_core.quantities.quantity import Quantity, none

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


@dataclass(frozen=True, eq=False)
class DisplacementField(Quantity):
    """In-plane displacement of the gel surface, at every pixel.

    The value at x is that of the surface point that is now at x.

    Attributes
    ----------
    cells_mm : (h, w, 2) float32
        Displacement relative to the reference, or to the last tare: +x right, +y down. One value
        per cell; cells of equal size tile the image, which has at least as many pixels as cells.
    valid : (H, W) bool
        False where the field is extrapolated beyond the markers.
    std_cells_mm : (h, w) float32 or None
        Standard deviation of a component, one value per cell; None if it is unknown.
    """

    cells_mm: Annotated[
        Float32, FieldSpec("mm", ("y", "x", "xy"), saved_as="displacement_mm", coarse=True)
    ]
    valid: Annotated[Bool, FieldSpec(axes=("y", "x"), saved_as="displacement_valid", validity=True)]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    std_cells_mm: Annotated[
        Float32 | None,
        FieldSpec(
            "mm",
            ("y", "x"),
            saved_as="displacement_std_mm",
            std_of="displacement_mm",
            coarse=True,
        ),
    ] = field(default_factory=none)

    @property
    def std_mm(self) -> Float32 | None:
        """(H, W) standard deviation of a component at every pixel; None if it is unknown."""
        return None if self.std_cells_mm is None else self.full("std_cells_mm")

    @cached_property
    def mm(self) -> Float32:
        """(H, W, 2) float32: the field at every pixel, interpolated between centres of cells."""
        return self.full("cells_mm")

    def layers(self) -> tuple[Layer, ...]:
        """Return the magnitude, with arrows."""
        return (VectorMap(self.mm, self.valid, "mm", "displacement"),)
