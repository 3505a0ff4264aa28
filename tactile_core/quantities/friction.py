"""Friction of the contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class Friction(Quantity):
    """Friction of the contact, and how close it is to slipping.

    Attributes
    ----------
    coefficient : float or None
        Coefficient of friction: measured once the contact has slipped, before that the profile's;
        None without contact, and before slip if the profile gives none.
    coefficient_std : float or None
        Its standard deviation; None unless it is measured.
    margin : float or None
        Share of the greatest shear force that acts, ‖Ft‖ ⁄ (µ Fn): 0 without shear, 1 when the
        contact slips; None if the coefficient is not known.
    """

    coefficient: Annotated[float | None, FieldSpec(saved_as="friction")] = None
    coefficient_std: Annotated[
        float | None, FieldSpec(saved_as="friction_std", std_of="friction")
    ] = None
    margin: Annotated[float | None, FieldSpec(saved_as="slip_margin")] = None
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return ``friction`` and ``margin`` of the entry ``slip``."""
        return {"slip": {"friction": self.coefficient, "margin": self.margin}}
