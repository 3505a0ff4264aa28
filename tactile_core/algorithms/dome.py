"""Geometry of a domed gel: a spherical cap whose apex is at the image centre.

Heights are relative to the dome, so every slope is that of the gel surface minus that of the dome.
Where the surface follows a ball, its height is, up to a constant, cap(ball) relative to a flat gel
and cap(ball) + cap(dome) relative to a dome: the dome acts like a second ball.
"""

from __future__ import annotations

import numpy as np

from tactile_core.algorithms.arrays.places import from_middle
from tactile_core.algorithms.arrays.types import Array, Float32


def cap(square: Array, radius: float) -> Array:
    """Height of a sphere above its equator.

    Parameters
    ----------
    square : (...)
        Squared distance from the axis.
    radius : float
        In the same unit of length.

    Returns
    -------
    (...)
        In that unit; 0 beyond the sphere.
    """
    return np.asarray(np.sqrt(np.maximum(radius**2 - square, 0)))


def rest_height(shape: tuple[int, int], *, mm_per_px: float, radius_mm: float) -> Float32:
    """Shape of the undeformed surface of a dome, along z of the sensor frame.

    Parameters
    ----------
    shape : (height, width) in px
    mm_per_px : float
        Scale of the image.
    radius_mm : float
        Radius of the sphere. Pixels outside the sphere get the height of its equator.

    Returns
    -------
    (H, W) float32
        z in mm: 0 at the apex in the image centre and negative elsewhere. z points towards the
        object; the border of the dome is nearer to the camera.
    """
    y, x = ((from_middle(n) * mm_per_px) ** 2 for n in shape)
    return np.asarray(cap(x + y[:, None], radius_mm) - radius_mm, np.float32)


def flat_equivalent(ball_radius: float, dome_radius: float | None) -> float:
    """Radius of the ball that indents a flat gel as this ball does a dome, near the apex.

    It is the effective radius of two spheres in contact, 1/R = 1/R₁ + 1/R₂ [1]_.

    Parameters
    ----------
    ball_radius : float
    dome_radius : float or None
        None for a flat gel.

    Returns
    -------
    float
        In the unit of the radii.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985, chapter 4.
    """
    if dome_radius is None:
        return ball_radius
    return ball_radius * dome_radius / (ball_radius + dome_radius)
