"""The sphere through a height map where a ball touches: a figure that needs no circle's radius."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_core.calibration.presses import FoundPress
from tactile_core.quantities import HeightMap

WITHIN = 0.65
"""Of the ball's radius, and never beyond the contact."""


def radius_px(height: HeightMap, press: FoundPress) -> float:
    """Radius of the sphere through the height inside the contact."""
    mask = press.surface(min(WITHIN * press.ball_radius_px, 0.95 * press.radius_px))
    rows, columns = np.nonzero(mask)
    x0, y0 = press.centre_px
    x, y = columns - x0, rows - y0
    z = height.mm[mask] / height.mm_per_px
    ball = press.ball_radius_px

    def residual(t: NDArray[np.float64]) -> NDArray[np.float64]:
        square = t[3] ** 2 - (x - t[0]) ** 2 - (y - t[1]) ** 2
        return np.asarray(t[2] + np.sqrt(np.maximum(square, 1e-3)) - z)

    start = [0.0, 0.0, float(z.max()) - ball, ball]
    return float(least_squares(residual, start, loss="soft_l1", f_scale=0.3).x[3])
