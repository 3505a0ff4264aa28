"""Centre of one ball under a light that may deviate from the common one at its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.quantile import quantile
from tactile_core.algorithms.arrays.types import Float32, Float64
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
    if samples.xy.shape[1] < CENTRE.fewest_pixels:
        nothing = np.zeros_like(light.spread)
        return FittedCentre(start, np.full((2, 2), np.inf), nothing, light.spread**2, np.inf)
    here = light.at(samples.place)
    prior = np.maximum(light.spread, CENTRE.least_spread).T ** -2.0
    deviation = np.zeros_like(light.spread)
    at = start.copy()
    per_pixel = samples.precision / np.float32(unit**2 * grain_px2)
    per_square = samples.precision / np.float32(unit**2)
    for _ in range(rounds):
        predicted, columns = _linearised(
            here.plus(deviation), _offset(samples, at, ball), shape, ball
        )
        now = predicted - samples.change
        above = samples.saturated & (now > 0)
        now[above] = 0
        weight = per_pixel / np.sqrt(1 + (per_square * now * now).sum(0))
        weight[above] = 0
        weighted = columns * weight[:, None]
        normal = (weighted @ columns.transpose(0, 2, 1)).astype(np.float64)
        right = (weighted @ now[..., None])[..., 0].astype(np.float64)
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
        step = (inverse @ mixed[..., None])[..., 0]
        deviation = deviation - step.T
        at = at + move
        if np.hypot(*move) < CENTRE.settled_px:
            break
    # Errors of the light and cast shadows are alike within a sector: it counts as one observation.
    by_centre = columns[:, :2] - gain.astype(np.float32) @ columns[:, 2:]
    pulls = ((weight * now)[:, None] * by_centre).sum(0)
    offset = _offset(samples, at, ball)
    angle = np.arctan2(offset[1], offset[0]) / np.float32(2 * np.pi) + np.float32(0.5)
    sector = np.minimum(angle * CENTRE.sectors, CENTRE.sectors - 1).astype(np.intp)
    sums: Float64 = np.array([np.bincount(sector, p, CENTRE.sectors) for p in pulls])
    inverse_centre = np.linalg.inv(reduced)
    covariance: Float64 = inverse_centre @ sums @ sums.T @ inverse_centre
    # The prediction after the last step, to first order.
    taken = np.concatenate([np.broadcast_to(move, (len(step), 2)), -step], axis=1)
    predicted += (taken.astype(np.float32)[:, None] @ columns)[:, 0]
    length = residuals(predicted, samples.change, samples.precision, samples.saturated)
    variance = np.diagonal(inverse, axis1=1, axis2=2).T
    expected: Float64 = tail * deviation**2 + variance
    return FittedCentre(at, covariance, deviation, expected, quantile(length, 0.5))


def _offset(samples: Samples, at: Float64, ball: float) -> Float32:
    """Offsets (2, N) of the pixels from the centre, in ball radii."""
    return np.asarray((samples.xy - at[:, None]) / ball, np.float32)


def _linearised(
    light: LocalLight, offset: Float32, shape: Shape, ball: float
) -> tuple[Float32, Float32]:
    """Predicted change (K, N), and its derivatives (K, 2 + S, N) by centre and coefficients."""
    normal, turn = shape.normal(offset)
    slopes, *by_normal = light.slopes_and_derivatives(normal)
    by_x, by_y = (light.of_slopes(slope) / np.float32(-ball) for slope in by_normal)
    columns = np.empty((len(by_x), 2 + len(slopes), slopes.shape[1]), np.float32)
    columns[:, 0] = by_x * turn[0] + by_y * turn[1]
    columns[:, 1] = by_x * turn[1] + by_y * turn[2]
    columns[:, 2:] = slopes
    return light.of_slopes(slopes), columns
