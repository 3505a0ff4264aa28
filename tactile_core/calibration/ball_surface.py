"""Gel surface on a ball: true slopes and heights, relative to those of the undeformed gel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.dome import cap
from tactile_core.quantities import Float32


@dataclass(frozen=True)
class BallSurface:
    """Surface of a gel where it follows a ball. All lengths are in px.

    Attributes
    ----------
    touch_px : (x, y)
        Point of first contact, where the slope is that of the undeformed gel.
    ball_radius_px : float
    dome_radius_px : float or None
        Radius of an undeformed domed gel; None for a flat one.
    shape : (height, width)
        Of the image; the apex of a dome is in its centre.
    """

    touch_px: tuple[float, float]
    ball_radius_px: float
    dome_radius_px: float | None
    shape: tuple[int, int]

    def spheres(self) -> list[tuple[np.ndarray, float]]:
        """Centres (x, y) and radii of the spheres whose caps add up to the height."""
        touch = np.asarray(self.touch_px)
        if self.dome_radius_px is None:
            return [(touch, self.ball_radius_px)]
        h, w = self.shape
        apex = np.array([w - 1, h - 1]) / 2
        # both centres and the point of first contact are collinear
        ball = apex + (touch - apex) * (1 + self.ball_radius_px / self.dome_radius_px)
        return [(ball, self.ball_radius_px), (apex, self.dome_radius_px)]

    def slopes(self, x: np.ndarray, y: np.ndarray) -> Float32:
        """(N, 2) slopes of the ball at N places, minus those of the undeformed gel."""
        slopes = np.zeros((len(x), 2))
        for centre_px, radius_px in self.spheres():
            offset = np.stack([x, y], 1) - centre_px
            depth_px = np.sqrt(np.maximum(radius_px**2 - (offset**2).sum(1), 1.0))
            slopes -= offset / depth_px[:, None]
        return slopes.astype(np.float32)

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(N,) sum of the heights of the spherical caps at N places, up to a constant."""
        height_px = np.zeros(len(x))
        for (x0, y0), radius_px in self.spheres():
            height_px += cap((x - x0) ** 2 + (y - y0) ** 2, radius_px)
        return height_px
