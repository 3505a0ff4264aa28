"""Sphere fit to a height map inside the contact: a figure that is independent of the circle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactile_core.calibration.presses import FoundPress
from tactile_core.quantities import HeightMap

WITHIN = 0.65
"""Radius of the fitted area in ball radii, at most the contact."""


def radius_px(height: HeightMap, press: FoundPress) -> float:
    """Radius of a sphere fitted to the height inside the contact, px."""
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
