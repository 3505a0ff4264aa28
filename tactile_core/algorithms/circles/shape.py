"""Shape of the gel surface under and around a ball: the component of its normals along the radius.

Inside the contact it is that of the ball. How it leaves the ball depends on thickness, stiffness
and coating of the gel, so its profile is measured (``profile``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape of an indentation; all lengths are in ball radii.

    Attributes
    ----------
    r : (J,) float64
        Distances from the centre, increasing. Nearer to the centre the shape is that of the ball.
    sines : (J,) float64
        Sine of the slope there.
    """

    r: Float64
    sines: Float64

    def sine(self, r: Float64) -> Float64:
        """Sine of the slope at these distances from the centre."""
        if not len(self.r):
            return r
        return np.where(r < self.r[0], r, np.interp(r, self.r, self.sines))

    def normal(self, offset: Float64) -> Float64:
        """x and y components (N, 2) of the unit normals at offsets (N, 2) from the centre."""
        if not len(self.r):
            return offset
        r = np.maximum(np.hypot(*offset.T), 1e-9)
        return np.asarray(offset * (self.sine(r) / r)[:, None])


BALL = Shape(np.zeros(0), np.zeros(0))
"""The ball itself, without a border."""
