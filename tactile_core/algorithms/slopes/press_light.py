"""Change of the light by a press, all over the view."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays import regression
from tactile_core.algorithms.arrays.types import Float32
from tactile_core.algorithms.light.photometric import place

PLACE_ORDER = 2  # Order of the tilt in the position, that of the models it belongs to

# [sine of the slope angle] Steeper pixels count as sloped: above noise and apparent tilt of level
# gel
_STEEP_SINE = 0.1


@dataclass(frozen=True, eq=False)
class PressLight:
    """Tilt that level gel seems to have while something is pressed into it.

    Light is guided along the gel, so that a press changes the brightness far beyond its contact,
    differently for each light. A slope model mistakes the change for a tilt that varies smoothly
    over the view. An undeformed gel shows none of it, and a frame with fewer slopes than a
    calibration frame shows less.

    Attributes
    ----------
    tilt : (2, 6) float32
        What to add to the components x and y of the normal, as polynomials of the position.
    steep_share : float
        Mean share of sloped pixels in the calibration frames.
    """

    tilt: Float32
    steep_share: float

    def strength(self, normal_xy: NDArray[Any]) -> np.float32:
        """Return the share of the tilt, 0 to 1, in a frame with these normals, (2, h, w)."""
        step = max(1, min(normal_xy.shape[1:]) // 60)  # about 60 rows are as good as all
        share = steep_share(normal_xy[:, step // 2 :: step, step // 2 :: step])
        return np.float32(min(1.0, share / self.steep_share) if self.steep_share else 0.0)

    def tilt_at(self, position: Float32) -> Float32:
        """Return the full tilt (2, N) at (N, 2) positions."""
        return np.asarray(self.tilt @ regression.terms(position, PLACE_ORDER).T, np.float32)

    def tilt_over(self, shape: tuple[int, int]) -> Float32:
        """Return the full tilt (2, h, w) over a grid of this shape."""
        return self.tilt_at(place(shape).reshape(-1, 2)).reshape(2, *shape)


def steep_share(normal_xy: NDArray[Any]) -> float:
    """Return the share of sloped pixels among normals (2, ...)."""
    return float(((normal_xy**2).sum(axis=0) > _STEEP_SINE**2).mean())
