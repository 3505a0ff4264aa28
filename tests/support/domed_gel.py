"""A ball pressed into a domed gel: analytic geometry of two spheres, and rendered frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Profile
from tactile_sim.optics.rig import render

Array = NDArray[Any]


@dataclass(frozen=True)
class DomedPress:
    """A ball on a dome, in the sensor frame: x, y from the image centre, in mm.

    Attributes
    ----------
    touch_mm : (x, y)
        Point of first contact.
    ball_mm, dome_mm : float
        Radii.
    contact_mm : float
        Radius of the contact in the image.
    """

    touch_mm: tuple[float, float]
    ball_mm: float
    dome_mm: float
    contact_mm: float

    @property
    def ball_centre_mm(self) -> Array:
        """(x, y) of the ball's centre, on the line from the dome's centre to the first contact."""
        return np.asarray(self.touch_mm) * (1 + self.ball_mm / self.dome_mm)

    def imprint(self, x: Array, y: Array) -> Array:
        """Height of the gel surface on the ball above the dome, up to a constant."""
        cx, cy = self.ball_centre_mm
        ball = np.sqrt(np.maximum(self.ball_mm**2 - (x - cx) ** 2 - (y - cy) ** 2, 0))
        return ball + np.sqrt(self.dome_mm**2 - x**2 - y**2)

    def inside(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Mask of the contact area."""
        return np.asarray(np.hypot(x - self.touch_mm[0], y - self.touch_mm[1]) < self.contact_mm)

    def height_mm(self, x: Array, y: Array) -> Array:
        """Height above the dome: the imprint, and a decaying skirt around it."""
        dx, dy = x - self.touch_mm[0], y - self.touch_mm[1]
        r = np.maximum(np.hypot(dx, dy), 1e-9)
        border = np.minimum(self.contact_mm / r, 1)
        at_border = self.imprint(self.touch_mm[0] + dx * border, self.touch_mm[1] + dy * border)
        skirt_mm = 0.3 * self.ball_mm
        slope = self.contact_mm / np.sqrt(self.ball_mm**2 - self.contact_mm**2)
        x0, y0 = (np.array([value]) for value in self.touch_mm)
        rim = self.imprint(x0 + self.contact_mm, y0) - slope * skirt_mm
        fading = np.exp(-np.maximum(r - self.contact_mm, 0) / skirt_mm)
        return np.asarray(
            np.where(border < 1, (at_border - rim) * fading, self.imprint(x, y) - rim)
        )


def pixels_mm(profile: Profile) -> tuple[Array, Array]:
    """(H, W) x and y of the pixels in the sensor frame."""
    image = profile.image
    y, x = np.mgrid[: image.height_px, : image.width_px] * image.mm_per_px
    return x - x.mean(), y - y.mean()


def photograph(profile: Profile, press: DomedPress | None, seed: int) -> NDArray[np.uint8]:
    """Render an image of the press."""
    x, y = pixels_mm(profile)
    height_mm = np.zeros_like(x) if press is None else press.height_mm(x, y)
    return render(profile, height_mm, seed=seed)
