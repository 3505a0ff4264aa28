"""Contact radius: where the gel surface leaves the ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import Change
from tactile_core.algorithms.circles.shape import BALL, Shape
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
    decays_after_drop : tuple of float, ball radii
        The same after the drop of the slope around a ball on a half-space, which itself decays.
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
    least_residual : float, logarithm of the intensity
        Lower bound of the residual scale.
        Source: chosen by hand; no script derives it.
    """

    smallest: float = 0.25
    largest: float = 0.98
    step: float = 0.03
    decays: tuple[float, ...] = (0.2, 0.35, 0.7)
    decays_after_drop: tuple[float, ...] = (0.4, 1.2, 4.0)
    reach: float = 1.5
    most_pixels: int = 1500
    fewest_pixels: int = 30
    steepest_sine: float = 0.999
    least_residual: float = 0.005


BORDER = BorderParameters()
"""The values in use."""


@dataclass(frozen=True)
class Border:
    """Border of a contact.

    Attributes
    ----------
    radius, std : float
        Contact radius and its standard deviation, in working pixels. The radius is 0 and its
        deviation infinite where too few pixels can be compared.
    shape : Shape
        Shape of the gel surface with this border.
    """

    radius: float
    std: float
    shape: Shape


NO_BORDER = Border(0.0, np.inf, BALL)
"""Of a press whose contact is not searched yet."""


def find_border(
    change: Change, light: Light, deviation: Float64, centre: Float64, ball_radius: float
) -> Border:
    """Find the radius at which the slope departs from that of the ball.

    Contact radius and decay length are those of the :class:`Shape` whose predicted change fits
    best, with soft-L1 weights.

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
    """
    x, y = change.disc(centre, BORDER.reach * ball_radius)
    visible = len(x)
    keep = np.random.default_rng(0).permutation(visible)[: BORDER.most_pixels]
    x, y = x[keep], y[keep]
    xy = np.stack([x, y], 1).astype(np.float64)
    if len(xy) < BORDER.fewest_pixels:
        return NO_BORDER
    offset = xy - centre
    r = np.hypot(*offset.T)
    direction = offset / np.maximum(r, 1e-6)[:, None]
    seen, saturated = change.values[y, x], change.saturated[y, x]
    precision = change.precision[y, x]
    # Along its direction the light of each pixel is a polynomial in the sine of the slope.
    powers = light.at(change.place(xy)).plus(deviation).along(direction)
    inside = r / ball_radius
    unit = max(light.residual, BORDER.least_residual) ** 2

    def cost(shape: Shape) -> float:
        sine = np.minimum(shape.sine(inside), BORDER.steepest_sine)[:, None]
        predicted = powers[-1] * sine
        for coefficients in powers[-2::-1]:
            predicted = (predicted + coefficients) * sine
        error = predicted - seen
        error[saturated & (error > 0)] = 0
        square = np.einsum("nk,nk,nk->n", precision, error, error)
        return float(np.mean(np.sqrt(1 + square / unit)))

    borders = np.arange(BORDER.smallest, BORDER.largest + 1e-9, BORDER.step)
    skirts = [(decay, True) for decay in BORDER.decays_after_drop]
    skirts += [(decay, False) for decay in BORDER.decays]
    table = np.array([[cost(Shape(border, *skirt)) for skirt in skirts] for border in borders])
    best, kind = np.unravel_index(int(np.argmin(table)), table.shape)
    costs, border, curvature = table.min(1), borders[best], 0.0
    if 0 < best < len(borders) - 1:
        three = costs[best - 1 : best + 2]
        border += vertex(-three) * BORDER.step
        curvature = float(three[0] - 2 * three[1] + three[2]) / BORDER.step**2
    sharpness = visible / change.grain_px2 * curvature
    std = min(1 / np.sqrt(sharpness), 1.0) if sharpness > 0 else 1.0
    shape = Shape(float(border), *skirts[kind])
    return Border(shape.border * ball_radius, float(std * ball_radius), shape)
