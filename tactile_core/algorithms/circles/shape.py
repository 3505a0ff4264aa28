"""Shape of the gel surface under and around a ball: the component of its normals along the radius.

Inside the contact it is that of the ball. Outside it decays exponentially, after a drop as sharp as
around a ball on a half-space [1]_ or without one, as where a stiff coating spreads the load.

References
----------
.. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985, section 4.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


@dataclass(frozen=True)
class Shape:
    """Shape of an indentation; all lengths are in ball radii.

    Attributes
    ----------
    border : float
        Radius of the contact; infinite for the ball itself, without a border.
    decay : float
        Decay length of the slope outside the contact.
    drops : bool
        Whether the slope drops as around a ball on a half-space.
    """

    border: float = np.inf
    decay: float = np.inf
    drops: bool = True

    def sine(self, r: Float64) -> Float64:
        """Sine of the slope at these distances from the centre."""
        if not np.isfinite(self.border):
            return r
        t = np.maximum(r / self.border, 1.0)
        drop = 2 / np.pi * (t * np.arcsin(1 / t) - np.sqrt(1 - 1 / t**2)) if self.drops else 1.0
        fade = np.exp(-np.maximum(r - self.border, 0) / self.decay)
        return np.where(r < self.border, r, self.border * drop * fade)

    def normal(self, offset: Float64) -> Float64:
        """x and y components (N, 2) of the unit normals at offsets (N, 2) from the centre."""
        if not np.isfinite(self.border):
            return offset
        r = np.maximum(np.hypot(*offset.T), 1e-9)
        return np.asarray(offset * (self.sine(r) / r)[:, None])


BALL = Shape()
"""The ball itself."""
