"""Output of a neural network whose meaning the core does not know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from tactile_core.algorithms.arrays.types import Float32
from tactile_core.quantities.fields import FieldSpec, TimestampS
from tactile_core.quantities.quantity import Quantity


@dataclass(frozen=True, eq=False)
class NetworkOutput(Quantity):
    """Numbers from a network: an embedding, or measurements that no other quantity holds.

    Attributes
    ----------
    values : (N,) float32
    names : tuple of N str
        Empty for an embedding.
    unit : str
        Of all values; empty if they are dimensionless.
    """

    values: Annotated[Float32, FieldSpec(axes=("output",), saved_as="network_output")]
    names: tuple[str, ...] = ()
    unit: str = ""
    timestamp_s: TimestampS = 0.0

    def summary(self) -> Mapping[str, Any]:
        """Return the entry ``network``: the values by name, or as a list."""
        numbers = [float(value) for value in self.values]
        named = dict(zip(self.names, numbers, strict=True)) if self.names else numbers
        return {"network": {"values": named, "unit": self.unit}}
