"""Shape of the gel surface under and around a ball: the component of its normals along the radius.

Inside the contact it is that of the ball. How it leaves the ball depends on thickness, stiffness
and coating of the gel, so its profile is measured (``profile``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Float32, Float64

_LEAST_R = np.float32(1e-9)  # Keeps the divisor positive at the centre itself


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape of an indentation; all lengths are in ball radii.

    Attributes
    ----------
    r : (J,) float64
        Distances from the centre, equally spaced and increasing. Nearer to the centre the shape is
        that of the ball.
    sines : (J,) float64
        Sine of the slope there.
    """

    r: Float64
    sines: Float64

    def normal(self, offset: Float32) -> tuple[Float32, Float32]:
        """Unit normals at offsets from the centre, and their derivatives.

        Parameters
        ----------
        offset : (2, N) float32

        Returns
        -------
        normal : (2, N) float32
            Their x and y components.
        turn : (3, N) float32
            Derivatives of x by x, of x and y by the other, and of y by y.
        """
        x, y = offset
        if not len(self.r):
            turn = np.ones((3, len(x)), np.float32)
            turn[1] = 0
            return offset, turn
        r = np.maximum(np.sqrt(x * x + y * y), _LEAST_R)
        step = (self.r[-1] - self.r[0]) / (len(self.r) - 1)
        place = (r - np.float32(self.r[0])) / np.float32(step)
        left = np.clip(place.astype(np.intp), 0, len(self.r) - 2)
        sines = self.sines.astype(np.float32)
        rise = (np.diff(sines) / np.float32(step))[left]
        beyond = place > len(self.r) - 1
        rise[beyond] = 0
        sine = np.where(beyond, sines[-1], sines[left] + (place - left) * np.float32(step) * rise)
        ratio = sine / r
        bend = (rise - ratio) / (r * r)  # of the ratio by the distance, over the distance
        ball = place < 0
        ratio[ball], bend[ball] = 1, 0
        return offset * ratio, np.stack([ratio + bend * x * x, bend * x * y, ratio + bend * y * y])


BALL = Shape(np.zeros(0), np.zeros(0))  # The ball itself, without a border
