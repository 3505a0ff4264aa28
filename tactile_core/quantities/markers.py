"""The printed markers: where each is, and which is which."""

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


@dataclass(frozen=True, eq=False)
class MarkerDetections(Quantity):
    """The markers that one frame shows, in no order and without identity.

    Attributes
    ----------
    centres_px : (N, 2) float32
        x and y of each marker's centroid, in the image.
    cut : (N,) bool
        The image's border cuts the marker, so that its centre is an estimate, perhaps out of view.
    """

    centres_px: Annotated[Float32, FieldSpec("px", _PLACES)]
    cut: Annotated[Bool, FieldSpec(axes=_EACH)]
    timestamp_s: TimestampS = 0.0


@dataclass(frozen=True, eq=False)
class MarkerField(Quantity):
    """Where every marker of the untouched skin is now.

    Attributes
    ----------
    ids : (N,) int32
        A marker keeps its number for as long as it is followed.
    reference_px : (N, 2) float32
        x and y of each marker on the untouched skin, or where it was when the load was tared.
    px : (N, 2) float32
        x and y of each marker now; inferred from its neighbours where it is not seen.
    seen : (N,) bool
        False where the position is inferred, or the marker's identity is not sure.
    mm_per_px : float
    started_in_contact : bool
        The markers were away from rest when following began: the reference shows a contact, and
        displacements tell the change since then, or the first frame did, and identities rest on
        how the skin deforms and not on having watched it.
    notes : tuple of str
        Sentences for the user about this frame.
    undeformed_px : (N, 2) float32 or None
        x and y of each marker in the image of the reference, which a tare leaves as it is; None
        where it is ``reference_px``.
    """

    ids: Annotated[Int32, FieldSpec(axes=_EACH, saved_as="marker_ids")]
    reference_px: Annotated[Float32, FieldSpec("px", _PLACES, saved_as="marker_reference_px")]
    px: Annotated[Float32, FieldSpec("px", _PLACES, saved_as="markers_px")]
    seen: Annotated[Bool, FieldSpec(axes=_EACH, saved_as="marker_seen")]
    mm_per_px: MmPerPx
    timestamp_s: TimestampS = 0.0
    started_in_contact: Annotated[bool, FieldSpec(saved_as="markers_started_in_contact")] = False
    notes: Annotated[tuple[str, ...], FieldSpec(saved_as="marker_notes")] = ()
    undeformed_px: Annotated[
        Float32 | None, FieldSpec("px", _PLACES, saved_as="marker_undeformed_px")
    ] = None

    @property
    def displacement_mm(self) -> Float32:
        """(N, 2) how far each marker was dragged: +x right, +y down."""
        return (self.px - self.reference_px) * np.float32(self.mm_per_px)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """The fields, and ``marker_displacement_mm``."""
        return {**super().arrays(), "marker_displacement_mm": self.displacement_mm}

    def layers(self) -> tuple[Layer, ...]:
        """Each marker, with an arrow from where it was; hollow where it is not seen."""
        return (Points(self.px, "markers", self.reference_px, self.seen),)

    def summary(self) -> Mapping[str, Any]:
        """How many markers are seen, of how many."""
        return {"markers": {"seen": int(self.seen.sum()), "expected": len(self.ids)}}

    def warnings(self) -> tuple[str, ...]:
        """The notes."""
        return self.notes
