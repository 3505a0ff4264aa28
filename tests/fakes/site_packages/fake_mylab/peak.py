"""The deepest point of a press."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import HeightMap, Quantity


@dataclass(frozen=True, eq=False)
class PeakHeight(Quantity):
    mm: float


class Peak(Estimator):
    def estimate(self, height: HeightMap) -> PeakHeight:
        return PeakHeight(float(height.mm.max()))
