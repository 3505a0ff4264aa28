"""A domed gel: a cap of a sphere, its apex at the image centre and towards the object.

Heights are measured from it, so every slope is that of the skin less that of the dome. The skin
on a ball has, up to a constant, the height cap(ball) relative to a flat gel and
cap(ball) + cap(dome) relative to a dome: a dome presses back like a second ball.
"""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Array, Float32


def cap(square: Array, radius: float) -> Array:
    """Height of a sphere over its equator, at squared distances from its axis; 0 beyond it.

    Any unit of length, the same for all.
    """
    return np.asarray(np.sqrt(np.maximum(radius**2 - square, 0)))


def rest_height(shape: tuple[int, int], *, mm_per_px: float, radius_mm: float) -> Float32:
    """Where the untouched skin of a dome lies along the sensor frame's z.

    Parameters
    ----------
    shape : (height, width) in px
    mm_per_px : float
        Scale of the image.
    radius_mm : float
        Of the sphere. What lies outside it is given the height of its equator.

    Returns
    -------
    (H, W) float32
        z in mm, 0 at the apex in the image centre and negative elsewhere: z points towards the
        object, and the dome's border lies nearer to the camera.
    """
    y, x = ((from_middle(n) * mm_per_px) ** 2 for n in shape)
    return np.asarray(cap(x + y[:, None], radius_mm) - radius_mm, np.float32)


def flat_equivalent(ball_radius: float, dome_radius: float | None) -> float:
    """Radius of the ball that presses a flat gel as this one does the dome, near its top.

    None is a flat gel, where it is the ball itself.
    """
    if dome_radius is None:
        return ball_radius
    return ball_radius * dome_radius / (ball_radius + dome_radius)
