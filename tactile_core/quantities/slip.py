"""Slip state of the contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity

SlipName = Literal["none", "stick", "incipient", "slip", "unknown"]
SlipKind = Literal["translation", "rotation"]


@dataclass(frozen=True, eq=False)
class SlipState(Quantity):
    """Slip state of the contact.

    Attributes
    ----------
    state : str
        ``none`` (no contact), ``stick``, ``incipient`` (the border of the contact slips), ``slip``
        (gross slip of the entire contact) or ``unknown`` (neither markers nor optical flow show the
        motion of the surface, the load is not known and no contact has settled yet, or the frames
        show no motion that can be followed: see ``reason``).
    degree : float
        Share of the contact that slips, or the evidence of it from the imprint: 0 if the entire
        contact sticks, 1 if all of it slips. Where the load is not known and the loss of contact is
        measured, the share of the contact that may be lost. 0 where nothing is measured. While
        markers cannot be followed, the degree is that of what is found of them.
    kind : str or None
        ``translation`` or ``rotation`` during slip; None otherwise.
    entropy_bits : float or None
        Entropy of the displacement magnitude in the contact area, with bins of 1/256 mm [1]_; None
        without contact.
    rotation_deg : float or None
        Rotation of the gel surface in contact, in degrees, positive from x towards y.
    onset_s : float or None
        Time at which the current incipient or gross slip began.
    distance_mm, distance_std_mm : float or None
        Distance by which the object moved over the gel surface since the contact settled, and its
        standard deviation; None if no imprint is tracked.

    reason : str
        Why the state is unknown; empty otherwise.
    degree_std : float or None
        Standard deviation of the degree; None if the degree is not the share of the contact that
        slips, measured in the field of displacement.

    References
    ----------
    .. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of Shear and Slip with a
       GelSight Tactile Sensor", ICRA, 2015.
    """

    state: Annotated[SlipName, FieldSpec(saved_as="slip_state")]
    degree: Annotated[float, FieldSpec(saved_as="slip_degree")]
    kind: Annotated[SlipKind | None, FieldSpec(saved_as="slip_kind")] = None
    entropy_bits: Annotated[
        float | None, FieldSpec("bit", saved_as="slip_entropy_bits", if_none=0.0)
    ] = None
    rotation_deg: Annotated[
        float | None, FieldSpec("deg", saved_as="rotation_deg", if_none=0.0)
    ] = None
    onset_s: Annotated[float | None, FieldSpec("s", saved_as="slip_onset_s")] = None
    distance_mm: Annotated[float | None, FieldSpec("mm", saved_as="slip_distance_mm")] = None
    distance_std_mm: Annotated[
        float | None, FieldSpec("mm", saved_as="slip_distance_std_mm", std_of="distance_mm")
    ] = None
    degree_std: Annotated[float | None, FieldSpec(saved_as="slip_degree_std", std_of="degree")] = (
        None
    )
    timestamp_s: TimestampS = 0.0
    reason: Annotated[str, FieldSpec(saved_as="slip_reason")] = ""

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``slip``; a step that knows the force fills in the last two values."""
        return {
            "slip": {
                "state": self.state,
                "degree": self.degree,
                "kind": self.kind,
                "entropy_bits": self.entropy_bits,
                "rotation_deg": self.rotation_deg,
                "onset_s": self.onset_s,
                "distance_mm": self.distance_mm,
                "distance_std_mm": self.distance_std_mm,
                "degree_std": self.degree_std,
                "margin": None,
                "friction": None,
                "reason": self.reason,
            }
        }
