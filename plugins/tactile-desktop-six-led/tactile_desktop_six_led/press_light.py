"""Change of the light by a press, all over the view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression

Float32 = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class PressLight:
    """Tilt that level gel seems to have while something is pressed into it.

    Light is guided along the gel, so that a press changes the brightness far beyond its contact,
    differently for each light. The photometric stereo mistakes the change for a tilt that varies
    smoothly over the view. It is fitted to presses together with the light field. An undeformed gel
    shows none of it and a frame with fewer slopes than a calibration frame shows less.

    Attributes
    ----------
    tilt : (2, 6) float32
        Components x and y of the unnormalised normal, as polynomials of the position.
    steep_share : float
        Mean share of sloped pixels in the calibration frames.
    """

    tilt: Float32
    steep_share: float

    def strength(self, steep_share: float) -> np.float32:
        """Return the share of the tilt, 0 to 1, in a frame with this share of sloped pixels."""
        return np.float32(min(1.0, steep_share / self.steep_share) if self.steep_share else 0.0)

    def tilt_at(self, position: Float32) -> Float32:
        """Return the full tilt (2, N) at (N, 2) positions."""
        # [order] that of the light field
        return np.asarray(self.tilt @ regression.terms(position, 2).T, np.float32)


def steep_share(normals: Float32) -> float:
    """Return the share of sloped pixels of (3, h, w) unnormalised normals."""
    step = max(1, min(normals.shape[1:]) // 60)  # about 60 rows are as good as all
    x, y, z = normals[:, step // 2 :: step, step // 2 :: step]
    across = x * x + y * y
    # [sine] above noise and the tilt of level gel
    return float((across > 0.1**2 * (across + z * z)).mean())
