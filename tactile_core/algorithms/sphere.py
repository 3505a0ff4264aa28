"""Radius of the sphere that a height map shows, estimated from the heights alone."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Bool, Float32, Float64


class SphereParameters(NamedTuple):
    """Parameters of the sphere fit. Nothing sets them, so that scores stay comparable.

    Attributes
    ----------
    least_height : float, depths
        Pixels above this share of the depth are fitted.
        Source: Hertz's contact, where the height is 1 − r²/(2 a²) of the depth within the radius a:
        this is r = 0.8 a, as for all scores. On thinner gels the pixels are closer to the centre.
    level_percentile, top_percentile : float, percent
        Percentiles of the heights that stand for the undeformed surface and for the deepest point.
        Source: chosen by hand; extremes without the outliers of single pixels.
    residual_px : float, px
        Height residuals beyond it lose weight (soft L1).
        Source: chosen by hand; on the scale of the errors of integrated heights.
    fewest_pixels : int, count
        With fewer pixels there is no fit.
        Source: chosen by hand; some ten times the four unknowns.
    most_pixels : int, count
        At most this many pixels are fitted.
        Source: chosen by hand; limits the time.
    """

    least_height: float = 0.68
    level_percentile: float = 5.0
    top_percentile: float = 99.5
    residual_px: float = 0.3
    fewest_pixels: int = 40
    most_pixels: int = 4000


SPHERE = SphereParameters()
"""The values in use."""


class Sphere(NamedTuple):
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


def fit_sphere(height_px: Float32, near: Bool, *, rest_px: Float32 | None = None) -> Sphere | None:
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
    level, top = np.percentile(height_px[near], (SPHERE.level_percentile, SPHERE.top_percentile))
    contact = _largest_part(near & (height_px > level + SPHERE.least_height * (top - level)))
    rows, columns = np.nonzero(contact)
    if len(rows) < SPHERE.fewest_pixels:
        return None
    step = -(-len(rows) // SPHERE.most_pixels)
    heights = height_px if rest_px is None else height_px - rest_px
    points = np.stack([columns, rows, heights[rows, columns]], 1)[::step]
    return _fitted(points.astype(np.float64))


def _largest_part(mask: Bool) -> Bool:
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8))
    if count < 2:
        return mask
    return np.asarray(parts == 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA]))


def _fitted(points: Float64) -> Sphere:
    """Return the sphere whose heights fit (N, 3) points best."""
    from scipy.optimize import least_squares

    middle = points.mean(axis=0)
    x, y, z = (points - middle).T

    def residual(t: Float64) -> Float64:
        # curvature instead of radius: a flat surface is a finite parameter
        square = (x - t[0]) ** 2 + (y - t[1]) ** 2
        root = np.sqrt(np.maximum(1 - t[3] ** 2 * square, 1e-3))
        return np.asarray(t[2] - square * t[3] / (1 + root) - z)

    extent, depth = float(np.hypot(x, y).max()), max(float(np.ptp(z)), 1e-6)
    curvature = 2 * depth / (extent**2 + depth**2)
    found = least_squares(
        residual,
        [0.0, 0.0, float(z.max()), curvature],
        loss="soft_l1",
        f_scale=SPHERE.residual_px,
        x_scale=[extent, extent, depth, curvature],
    ).x
    radius_px = float(1 / found[3]) if found[3] else float("inf")
    return Sphere((float(middle[0] + found[0]), float(middle[1] + found[1])), radius_px)
