"""Contact radius: where the gel surface leaves the ball."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import Change
from tactile_core.algorithms.circles.symmetry import vertex


class BorderParameters(NamedTuple):
    """Parameters of the search for the contact radius.

    Nothing sets them from outside: they are relative to the radius of the ball.

    Attributes
    ----------
    smallest, largest, step : float, ball radii
        Range and step of the search over contact radii.
        Source: chosen by hand; no script derives it.
    decays : tuple of float, ball radii
        Decay lengths of the slope outside the contact that are tried.
        Source: chosen by hand; no script derives it.
    reach : float, ball radii
        Pixels up to this distance from the centre are compared.
        Source: chosen by hand; no script derives it.
    most_pixels, fewest_pixels : int, count
        Pixels that are drawn at random, and below which no contact is found.
        Source: chosen by hand; no script derives it.
    steepest_sine : float, ratio
        Upper bound of the sine of the slope.
        Source: chosen by hand, just below 1; no script derives it.
    least_residual : float, grey levels of 8 bits
        Lower bound of the residual scale.
        Source: chosen by hand; no script derives it.
    """

    smallest: float = 0.25
    largest: float = 0.98
    step: float = 0.03
    decays: tuple[float, ...] = (0.2, 0.3, 0.45, 0.7)
    reach: float = 1.5
    most_pixels: int = 1500
    fewest_pixels: int = 30
    steepest_sine: float = 0.999
    least_residual: float = 1.0


BORDER = BorderParameters()
"""The values in use."""


def contact_radius(change: Change, light: Light, centre: Float64, ball_radius: float) -> float:
    """Estimate the radius at which the slope departs from that of the ball.

    Inside, the sine of the slope is r / R; outside, it decays exponentially. Contact radius and
    decay length are those whose predicted colours fit best, with soft-L1 weights.

    Parameters
    ----------
    change : Change
        Colour change of the press.
    light : Light
        Forward model of the light.
    centre : (2,) float64
        Centre of the ball, in working pixels.
    ball_radius : float
        In working pixels.

    Returns
    -------
    float
        In working pixels; 0 where too few pixels can be compared.
    """
    x, y = change.disc(centre, BORDER.reach * ball_radius)
    keep = np.random.default_rng(0).permutation(len(x))[: BORDER.most_pixels]
    xy = np.stack([x[keep], y[keep]], 1).astype(np.float64)
    if len(xy) < BORDER.fewest_pixels:
        return 0.0
    offset = xy - centre
    r = np.hypot(*offset.T)
    direction = offset / np.maximum(r, 1e-6)[:, None]
    colour, saturated = change.values[y[keep], x[keep]], change.saturated[y[keep], x[keep]]
    # Along its direction the light of each pixel is a polynomial in the sine of the slope.
    powers = light.at(xy).along(direction)
    inside = r / ball_radius
    unit = max(light.residual, BORDER.least_residual) ** 2

    def cost(border: float, decay: float) -> float:
        outside = border * np.exp(-np.maximum(inside - border, 0) / decay)
        sine = np.where(inside < border, inside, outside)
        sine = np.minimum(sine, BORDER.steepest_sine)[:, None]
        predicted = powers[-1] * sine
        for coefficients in powers[-2::-1]:
            predicted = (predicted + coefficients) * sine
        error = predicted - colour
        error[saturated & (error > 0)] = 0
        return float(np.mean(np.sqrt(1 + np.einsum("nk,nk->n", error, error) / unit)))

    borders = np.arange(BORDER.smallest, BORDER.largest + 1e-9, BORDER.step)
    costs = np.array([min(cost(border, decay) for decay in BORDER.decays) for border in borders])
    best = int(np.argmin(costs))
    border = borders[best]
    if 0 < best < len(borders) - 1:
        border += vertex(-costs[best - 1 : best + 2]) * BORDER.step
    return float(border * ball_radius)
