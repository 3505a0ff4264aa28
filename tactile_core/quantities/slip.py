"""Whether the contact holds, and how it gives way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity

SlipName = Literal["none", "stick", "incipient", "slip"]
SlipKind = Literal["translation", "rotation"]


@dataclass(frozen=True, eq=False)
class SlipState(Quantity):
    """Whether the contact holds.

    Attributes
    ----------
    state : str
        ``none`` (nothing touches), ``stick``, ``incipient`` (the border of the contact slips) or
        ``slip`` (all of it does).
    degree : float
        0 where all of the contact sticks, 1 where all of it slips.
    kind : str or None
        ``translation`` or ``rotation`` while something slips.
    entropy_bits : float or None
        Of the displacement's magnitude over the contact, in bins of 1/256 mm [Yuan 2015]; None
        where nothing touches.
    rotation_deg : float or None
        How far the skin in contact is turned, positive from x towards y.
    onset_s : float or None
        Time at which the present incipient or gross slip began.
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
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """The entry ``slip``."""
        return {
            "slip": {
                "state": self.state,
                "degree": self.degree,
                "kind": self.kind,
                "entropy_bits": self.entropy_bits,
                "rotation_deg": self.rotation_deg,
                "onset_s": self.onset_s,
            }
        }
