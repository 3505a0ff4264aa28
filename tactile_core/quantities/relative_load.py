"""How hard the object presses, without a unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class RelativeLoad(Quantity):
    """A number that grows with the normal force; its scale depends on the sensor and the object.

    Attributes
    ----------
    load : float
        Dimensionless; 0 at rest, apart from noise.
    """

    load: Annotated[float, FieldSpec(saved_as="load")]
    timestamp_s: TimestampS = 0.0
