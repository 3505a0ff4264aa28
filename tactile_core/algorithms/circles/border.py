"""Contact radius: where the gel surface leaves the ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import Change
from tactile_core.algorithms.circles.profile import radial_profile
from tactile_core.algorithms.circles.shape import BALL, Shape


class BORDER:
    """Parameters of the search for the contact radius.

    Nothing sets them from outside: they are relative to the slope or the radius of the ball.

    References
    ----------
    .. [1] K. L. Johnson, "Contact Mechanics", Cambridge University Press, 1985, section 4.2.
    """

    # [ratio] Slope at the border, over that of the ball. Without smoothing it would be 1. Source:
    # the profile around a ball on a half-space [1]_, smoothed as the image is, has 0.83 for
    # contacts of 0.6 ball radii; 0.8 to 0.84 on layers (``experiments/circle_finding.py``).
    level = 0.82
    left = 0.5  # [ratio] With a smaller slope relative to the ball's the surface has left the ball
    # [ratio] The distance between the places where the slope is this much above and below the
    # level is the width of the border. Source: by hand, : less than the difference between the
    # level and 1.
    margin = 0.08
    # [ball radii] Next to the border, within this distance, the slope inside is smoothed, and
    # measured instead of that of the ball. Source: by hand, : three standard deviations of the
    # smoothing of the image.
    blurred = 0.1
    # [ball radii] Upper bound of the contact radius. Source: by hand, just below the equator.
    largest = 0.98


@dataclass(frozen=True, eq=False)
class Border:
    """Border of a contact, in working pixels.

    Attributes
    ----------
    radius : float
        Contact radius; 0 where too few pixels can be compared.
    disagreement : float
        Standard deviation of the radius by how much the sectors of the disc disagree: their
        jackknife [1]_.
    width : float
        Distance over which the surface leaves the ball. Shadows and smoothing widen it.
    shape : Shape
        Shape of the gel surface with this border.

    References
    ----------
    .. [1] B. Efron and C. Stein, "The jackknife estimate of variance", Annals of Statistics 9(3),
       1981.
    """

    radius: float
    disagreement: float
    width: float
    shape: Shape


NO_BORDER = Border(0.0, np.inf, np.inf, BALL)  # Of a press whose contact is not searched yet


def find_border(
    change: Change,
    light: Light,
    deviation: Float64,
    centre: Float64,
    ball_radius: float,
    *,
    with_std: bool = True,
) -> Border:
    """Find the radius at which the slope departs from that of the ball.

    How sharply it does depends on the gel, so the slope is measured at every distance from the
    centre, and compared with that of the ball.

    Parameters
    ----------
    change : Change
        Change of the image by the press.
    light : Light
        Forward model of the light.
    deviation : (S, K) float64
        Deviation of its coefficients at this press.
    centre : (2,) float64
        Centre of the ball, in working pixels.
    ball_radius : float
        In working pixels.
    with_std : bool
        False saves the time of ``disagreement``, which is then infinite.
    """
    found = radial_profile(change, light, deviation, centre, ball_radius, jackknifed=with_std)
    if found is None:
        return NO_BORDER
    radius, inner, outer = (
        _radius(found.r, found.sines, BORDER.level + margin)
        for margin in (0.0, BORDER.margin, -BORDER.margin)
    )
    others = np.array([_radius(found.r, sines, BORDER.level) for sines in found.without])
    disagreement = float(np.sqrt((len(others) - 1) * others.var())) if with_std else np.inf
    on_ball = found.r < radius - BORDER.blurred
    shape = Shape(found.r, np.where(on_ball, found.r, found.sines))
    width = outer - inner
    return Border(radius * ball_radius, disagreement * ball_radius, width * ball_radius, shape)


def _radius(r: Float64, sines: Float64, level: float) -> float:
    """Distance at which the slope falls below a level of that of the ball, interpolated."""
    ratio = sines / r
    left = np.flatnonzero(ratio < BORDER.left)
    end = left[0] if len(left) else len(r) - 1
    above = np.flatnonzero(ratio[:end] >= level)
    if not len(above):
        return float(r[0])
    i = above[-1]
    share = (ratio[i] - level) / (ratio[i] - ratio[i + 1])
    return min(float(r[i] + share * (r[i + 1] - r[i])), BORDER.largest)
