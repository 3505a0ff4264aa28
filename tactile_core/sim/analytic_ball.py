"""Indentation by a ball in closed form: ground truth for tests, without mechanics.

The gel surface follows the ball inside the contact and decays exponentially outside it. For
elastic contact mechanics use :class:`tactile_core.sim.VirtualStage`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.profiles.model import Profile


@dataclass(frozen=True)
class BallPress:
    """A ball pressed into the gel surface.

    Attributes
    ----------
    centre_px : (x, y)
    diameter_mm : float
        Diameter of the ball.
    depth_mm : float
        Height of the ball's cap inside the contact: indentation at the centre minus indentation at
        the contact's border.
    """

    centre_px: tuple[float, float]
    diameter_mm: float
    depth_mm: float

    @property
    def contact_radius_mm(self) -> float:
        """Radius of the contact circle."""
        return float(np.sqrt(self.depth_mm * (self.diameter_mm - self.depth_mm)))

    def height_mm(self, shape: tuple[int, int], mm_per_px: float) -> NDArray[np.float64]:
        """(H, W) height of the gel surface, mm; positive where it is indented."""
        x = (np.arange(shape[1]) - self.centre_px[0]) * mm_per_px
        y = (np.arange(shape[0])[:, None] - self.centre_px[1]) * mm_per_px
        r, radius, a = np.hypot(x, y), self.diameter_mm / 2, self.contact_radius_mm
        rim = np.sqrt(radius**2 - a**2)
        skirt_mm = 0.3 * radius  # decay length of the indentation outside the contact
        edge_mm = skirt_mm * a / rim  # makes the slope continuous at the border
        inside = np.sqrt(np.maximum(radius**2 - r**2, 0)) - rim + edge_mm
        return np.asarray(
            np.where(r < a, inside, edge_mm * np.exp(-np.maximum(r - a, 0) / skirt_mm))
        )


def render(profile: Profile, height_mm: NDArray[Any], *, seed: int = 0) -> NDArray[Any]:
    """Render the (H, W, K) image that the profile's camera takes of this height.

    The sensor unit is always the same; the seed selects the image noise. To render many images,
    keep a :class:`~tactile_core.sim.optics.RigOptics`.
    """
    from tactile_core.sim.optics.rig import RigOptics

    return RigOptics(profile).expose(height_mm, frame=seed)
