"""Spheres: a fitted one, a ball that presses, and the dome that heights are measured from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Bool, Float32, Float64, from_middle

# [depths] Pixels above this share of the depth are fitted: Hertz's contact, where the height is 1 −
# r²/(2 a²) of the depth within the radius a: this is r = 0.8 a, as for all scores. On thinner gels
# the pixels are closer to the centre
_LEAST_HEIGHT = 0.68


class FittedSphere(NamedTuple):
    """A sphere that was fitted to heights.

    Attributes
    ----------
    centre_px : (x, y)
        0-based, integers at pixel centres.
    radius_px : float
        Negative if the heights are a hollow.
    """

    centre_px: tuple[float, float]
    radius_px: float


@dataclass(frozen=True)
class BallPress:
    """A ball pressed into the gel surface, in closed form: ground truth without mechanics.

    The gel surface follows the ball inside the contact and decays exponentially outside it.

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

    def height_mm(self, shape: tuple[int, int], mm_per_px: float) -> Float64:
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


def fit_sphere(
    height_px: Float32, near: Bool, *, rest_px: Float32 | None = None
) -> FittedSphere | None:
    """Fit a sphere to the highest part of a height map.

    The pixels are selected by their heights, so that the result depends on no circle that was found
    in the image.

    Parameters
    ----------
    height_px : (H, W) float
        Heights in pixels, up to a constant; an object raises them.
    near : (H, W) bool
        Area that contains the contact and some of its surroundings.
    rest_px : (H, W) float, optional
        Shape of the undeformed surface that the heights are relative to, towards the object; flat
        by default.

    Returns
    -------
    Sphere or None
        None with too few pixels.
    """
    if not near.any():
        return None
    # [percent] extremes without the outliers of single pixels
    level, top = np.percentile(height_px[near], (5.0, 99.5))
    contact = _largest_part(near & (height_px > level + _LEAST_HEIGHT * (top - level)))
    rows, columns = np.nonzero(contact)
    if len(rows) < 40:  # [pixels] ten times the four unknowns
        return None
    step = -(-len(rows) // 4000)  # [pixels] for speed
    heights = height_px if rest_px is None else height_px - rest_px
    points = np.stack([columns, rows, heights[rows, columns]], 1)[::step]
    return _fit_sphere(points.astype(np.float64))


def _largest_part(mask: Bool) -> Bool:
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    if count < 2:
        return mask
    return np.asarray(parts == 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA]))


def _fit_sphere(points: Float64) -> FittedSphere:
    """Return the sphere whose heights fit (N, 3) points best."""
    from scipy.optimize import least_squares

    middle = points.mean(axis=0)
    x, y, z = (points - middle).T
    extent, depth = float(np.hypot(x, y).max()), max(float(np.ptp(z)), 1e-6)
    # curvature instead of radius: a flat surface is a finite parameter
    curvature = 2 * depth / (extent**2 + depth**2)

    def residuals(at: Float64) -> Float64:
        square = (x - at[0]) ** 2 + (y - at[1]) ** 2
        root = np.sqrt(np.maximum(1 - at[3] ** 2 * square, 0))
        return np.asarray(at[2] - square * at[3] / (1 + root) - z)

    found = least_squares(
        residuals,
        (0.0, 0.0, float(z.max()), curvature),
        x_scale=(extent, extent, depth, curvature),
        loss="soft_l1",
        f_scale=0.3,  # [px] errors of integrated heights
    ).x
    radius_px = float(1 / found[3]) if found[3] else float("inf")
    return FittedSphere((float(middle[0] + found[0]), float(middle[1] + found[1])), radius_px)


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
