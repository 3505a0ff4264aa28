"""Release of shear: how far the gel surface sprang back from its largest shear.

An object that slips lets the surface spring back, while one that sticks keeps it sheared.
"""

from __future__ import annotations

import math


class RELEASE:
    """Parameters of the release of shear."""

    # [s] Time constant with which the largest shear is forgotten. Source: as long as changes of
    # the imprint are remembered.
    memory_s = 1.0
    # [mm] Shear below which a release is relative to this value, so that noise releases nothing.
    # Source: by hand, several times the noise of a marker.
    least_mm = 0.05


class ShearPeak:
    """The largest recent shear of a surface, and the share of it that was released."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all earlier shear."""
        self._peak_mm = self._time_s = 0.0

    def update(self, shear_mm: float, timestamp_s: float) -> float:
        """Take the next shear; return the released share, from 0 to 1."""
        kept = math.exp(-max(timestamp_s - self._time_s, 0.0) / RELEASE.memory_s)
        self._time_s = timestamp_s
        self._peak_mm = shear_mm + max(self._peak_mm - shear_mm, 0.0) * kept
        return (self._peak_mm - shear_mm) / max(self._peak_mm, RELEASE.least_mm)
