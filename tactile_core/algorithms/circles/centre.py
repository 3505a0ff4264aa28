"""Centre of one ball under a light that may deviate from the common one at its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light, LocalLight, Samples, residuals
from tactile_core.algorithms.circles.shape import Shape


class CentreParameters(NamedTuple):
    """Parameters of the fit of a centre.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.

    Attributes
    ----------
    fewest_pixels : int, count
        With fewer pixels a centre is not refined.
        Source: chosen by hand; no script derives it.
    least_residual : float, logarithm of the intensity
        Lower bound of the residual scale of the soft-L1 weights.
        Source: chosen by hand; no script derives it.
    largest_step : float, ball radii
        Upper bound of a Gauss–Newton step.
        Source: chosen by hand; no script derives it.
    settled_px : float, working px
        Gauss–Newton ends when the centre moves less.
        Source: chosen by hand; no script derives it.
    difference : float, component of the normal
        Step of the difference quotients.
        Source: mathematics; the error is of its order, far below that of the light.
    sectors : int, count
        Sectors of the disc whose residuals are independent of each other.
        Source: chosen by hand: an attached shadow is about as wide.
    tail : float, ratio
        Degrees of freedom of the prior, Student's t, relative to the number of coefficients.
        Source: chosen by hand on virtual units (``experiments/circle_finding.py``).
    least_spread : float, logarithm of the intensity
        Lower bound of ``Light.spread``, against division by zero.
        Source: chosen by hand; no script derives it.
    """

    fewest_pixels: int = 30
    least_residual: float = 0.005
    largest_step: float = 0.3
    settled_px: float = 1e-3
    difference: float = 1e-5
    sectors: int = 12
    tail: float = 0.3
    least_spread: float = 1e-6


CENTRE = CentreParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class FittedCentre:
    """Centre of a ball, and the light at its place.

    Attributes
    ----------
    at : (2,) float64
        In working pixels.
    covariance : (2, 2) float64
        Of the centre, in working px², by how much the sectors of the disc disagree [1]_.
    deviation : (S, K) float64
        Of the light's coefficients from those of the common light.
    square : (S, K) float64
        Expected square of the deviation, less for a press that deviates more than the others.
    residual : float
        Median residual; infinite where too few pixels are visible.

    References
    ----------
    .. [1] K.-Y. Liang and S. L. Zeger, "Longitudinal data analysis using generalized linear
       models", Biometrika 73(1), 1986.
    """

    at: Float64
    covariance: Float64
    deviation: Float64
    square: Float64
    residual: float


def fit_centre(
    samples: Samples,
    light: Light,
    start: Float64,
    ball: float,
    shape: Shape,
    grain_px2: float,
    rounds: int,
) -> FittedCentre:
    """Fit the centre of a ball to the pixels on it.

    Gauss–Newton with soft-L1 weights on the two coordinates and on the deviations of the light's
    coefficients. The prior of the deviations is Student's t distribution of the width
    ``light.spread``. It keeps what the other presses determine; where the common light is wrong,
    the symmetry of the press itself decides.

    Parameters
    ----------
    samples : Samples
    light : Light
    start : (2,) float64
        First estimate of the centre, working px.
    ball : float
        Radius of the ball, working px.
    shape : Shape
        Shape of the gel surface around the centre.
    grain_px2 : float
        Area over which the noise is correlated, working px²: that many pixels count as one.
    rounds : int
        Most Gauss–Newton steps.
    """
    unit = max(light.residual, CENTRE.least_residual)
    if len(samples.xy) < CENTRE.fewest_pixels:
        nothing = np.zeros_like(light.spread)
        return FittedCentre(start, np.full((2, 2), np.inf), nothing, light.spread**2, np.inf)
    here = light.at(samples.place)
    prior = np.maximum(light.spread, CENTRE.least_spread).T ** -2.0
    deviation = np.zeros_like(light.spread)
    at = start.copy()
    per_pixel = samples.precision / (unit**2 * grain_px2)
    for _ in range(rounds):
        predicted, columns = _linearised(here.plus(deviation), samples.xy - at, shape, ball)
        now = predicted - samples.change
        above = samples.saturated & (now > 0)
        now[above] = 0
        square = (samples.precision * now * now).sum(1)
        weight = per_pixel / np.sqrt(1 + square / unit**2)[:, None]
        weight[above] = 0
        weighted = (columns * weight.T[..., None]).transpose(0, 2, 1)  # (K, 2 + S, N)
        normal = weighted @ columns
        right = (weighted @ now.T[..., None])[..., 0]
        far = float((prior * deviation.T**2).mean())
        tail = (1 + CENTRE.tail) / (far + CENTRE.tail)
        inner, tilt = normal[:, 2:, 2:], right[:, 2:] + tail * prior * deviation.T
        inner[:, *np.diag_indices(inner.shape[1])] += tail * prior
        inverse = np.linalg.inv(inner)
        # Eliminates the deviations of each channel, which leaves the two coordinates.
        gain = normal[:, :2, 2:] @ inverse
        reduced = (normal[:, :2, :2] - gain @ normal[:, 2:, :2]).sum(0)
        reduced += (1e-9 * np.trace(reduced) + 1e-12) * np.eye(2)
        pull = (right[:, :2, None] - gain @ tilt[..., None]).sum(0)[:, 0]
        move = -np.linalg.solve(reduced, pull)
        move *= min(1.0, CENTRE.largest_step * ball / max(float(np.hypot(*move)), 1e-9))
        mixed = tilt + normal[:, 2:, :2] @ move
        deviation = deviation - (inverse @ mixed[..., None])[..., 0].T
        at = at + move
        if np.hypot(*move) < CENTRE.settled_px:
            break
    # Errors of the light and cast shadows are alike within a sector: it counts as one observation.
    by_centre = columns[..., :2] - columns[..., 2:] @ gain.transpose(0, 2, 1)
    pulls = np.einsum("nk,nk,kna->na", weight, now, by_centre)
    angle = np.arctan2(*(samples.xy - at).T[::-1]) / (2 * np.pi) + 0.5
    sector = np.minimum(angle * CENTRE.sectors, CENTRE.sectors - 1).astype(np.intp)
    sums: Float64 = np.array([np.bincount(sector, p, CENTRE.sectors) for p in pulls.T])
    inverse_centre = np.linalg.inv(reduced)
    covariance: Float64 = inverse_centre @ sums @ sums.T @ inverse_centre
    length = residuals(
        here.plus(deviation)(shape.normal((samples.xy - at) / ball)),
        samples.change,
        samples.precision,
        samples.saturated,
    )
    variance = np.diagonal(inverse, axis1=1, axis2=2).T
    expected: Float64 = tail * deviation**2 + variance
    return FittedCentre(at, covariance, deviation, expected, float(np.median(length)))


def _linearised(
    light: LocalLight, offset: Float64, shape: Shape, ball: float
) -> tuple[Float64, Float64]:
    """Predicted change (N, K), and its derivatives (K, N, 2 + S) by centre and coefficients."""
    step = CENTRE.difference
    slopes = light.slopes(shape.normal(offset / ball))
    by_offset = [
        (light.slopes(shape.normal(offset / ball + d)) - slopes) / step
        for d in (np.array([step, 0.0]), np.array([0.0, step]))
    ]
    products = np.stack([slopes, *by_offset], 1) @ light.coefficients  # (N, 3, K)
    by_centre = products[:, 1:].transpose(2, 0, 1) / -ball
    by_light = np.broadcast_to(slopes, (len(by_centre), *slopes.shape))
    return products[:, 0], np.concatenate([by_centre, by_light], axis=2)
