"""Centre of one ball under a light that may deviate from the common one at its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import Bool, Float32, Float64
from tactile_core.algorithms.circles.circle import Shape
from tactile_core.algorithms.circles.light import LightModel, Samples, residuals


class CENTRE:
    """Parameters of the fit of a centre.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.
    """

    fewest_pixels = 30  # [count] With fewer pixels a centre is not refined
    # [logarithm of the intensity] Lower bound of the residual scale of the soft-L1 weights.
    least_residual = 0.005
    largest_step = 0.3  # [ball radii] Upper bound of a Gauss–Newton step
    # [count] Sectors of the disc whose residuals are independent of each other. Source: by hand,
    # : an attached shadow is about as wide.
    sectors = 12
    # [ratio] Degrees of freedom of the prior, Student's t, relative to the number of
    # coefficients. Of its tails one step sees nothing: without deviation it weighs (1 + tail) /
    # tail times as much as a normal distribution. Source: by hand, on virtual units
    # (``experiments/circle_finding.py``).
    tail = 0.3
    # [logarithm of the intensity] Lower bound of ``LightModel.spread``, against division by zero.
    least_spread = 1e-6
    # [count] Balls that are fitted together; their pixels stay in the cache. Source: measured
    # (ADR 92), among 1 to 24.
    together = 6


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


class BallPixels(NamedTuple):
    """Pixels on a ball, to which its centre is fitted.

    Attributes
    ----------
    samples : Samples
    start : (2,) float64
        First estimate of the centre, working px.
    ball : float
        Radius of the ball, working px.
    shape : Shape
        Shape of the gel surface around the centre.
    grain_px2 : float
        Area over which the noise is correlated, working px²: that many pixels count as one.
    """

    samples: Samples
    start: Float64
    ball: float
    shape: Shape
    grain_px2: float


def fit_centres(balls: Sequence[BallPixels], light: LightModel) -> list[FittedCentre]:
    """Fit the centre of each ball to the pixels on it.

    One Gauss–Newton step with soft-L1 weights on the two coordinates and on the deviations of the
    light's coefficients, from none on. The prior of the deviations has the width ``light.spread``.
    It keeps what the other presses determine; where the common light is wrong, the symmetry of the
    press itself decides. The balls are independent; fitting them together takes fewer calls.

    Parameters
    ----------
    balls : sequence of BallPixels
    light : LightModel

    Returns
    -------
    list of FittedCentre, in the order of the balls
    """
    fits = [ball.samples.xy.shape[1] >= CENTRE.fewest_pixels for ball in balls]
    some = [ball for ball, fit in zip(balls, fits, strict=True) if fit]
    parts = (some[i : i + CENTRE.together] for i in range(0, len(some), CENTRE.together))
    fitted = iter([centre for part in parts for centre in _fit_balls(part, light)])
    nothing = np.zeros_like(light.spread), light.spread**2
    return [
        next(fitted) if fit else FittedCentre(ball.start, np.full((2, 2), np.inf), *nothing, np.inf)
        for ball, fit in zip(balls, fits, strict=True)
    ]


def _fit_balls(balls: Sequence[BallPixels], light: LightModel) -> list[FittedCentre]:
    """Fit balls with enough pixels."""
    unit = max(light.residual, CENTRE.least_residual)
    pixels = _Pixels.from_balls(balls)
    predicted, columns = pixels.linearise_change(light)
    now = predicted - pixels.change
    above = pixels.saturated & (now > 0)
    now[above] = 0
    per_square = pixels.precision / np.float32(unit**2)
    weight = per_square / np.sqrt(1 + (per_square * now * now).sum(0))
    weight /= np.array([ball.grain_px2 for ball in balls], np.float32)[:, None]
    weight[above] = 0
    by_ball = columns.transpose(2, 0, 1, 3)
    weighted = (columns * weight[:, None]).transpose(2, 0, 1, 3)
    normal = (weighted @ by_ball.swapaxes(2, 3)).astype(np.float64)
    right = (weighted @ now.transpose(1, 0, 2)[..., None]).astype(np.float64)
    tail = (1 + CENTRE.tail) / CENTRE.tail
    prior = np.maximum(light.spread, CENTRE.least_spread).T ** -2.0
    inner = normal[:, :, 2:, 2:]
    diagonal = np.arange(inner.shape[-1])
    inner[..., diagonal, diagonal] += tail * prior
    inverse = np.linalg.inv(inner)
    # Eliminates the deviations of each channel, which leaves the two coordinates.
    gain = normal[:, :, :2, 2:] @ inverse
    reduced = (normal[:, :, :2, :2] - gain @ normal[:, :, 2:, :2]).sum(1)
    trace = reduced[:, 0, 0] + reduced[:, 1, 1]
    reduced[:, [0, 1], [0, 1]] += (1e-9 * trace + 1e-12)[:, None]
    inverse_centre = np.linalg.inv(reduced)
    move = -inverse_centre @ (right[:, :, :2] - gain @ right[:, :, 2:]).sum(1)
    largest = CENTRE.largest_step * np.array([ball.ball for ball in balls])
    length = np.hypot(move[:, 0, 0], move[:, 1, 0])
    move *= np.minimum(1.0, largest / np.maximum(length, 1e-9))[:, None, None]
    deviation = -inverse @ (right[:, :, 2:] + normal[:, :, 2:, :2] @ move[:, None])
    # Errors of the light and cast shadows are alike within a sector: it counts as one observation.
    by_centre = by_ball[:, :, :2] - gain.astype(np.float32) @ by_ball[:, :, 2:]
    pulls = np.einsum("kbn,bkin->ibn", weight * now, by_centre)
    sums = inverse_centre @ pixels.by_sector(pulls, move[..., 0])
    # The prediction after the step, to first order.
    moves = np.broadcast_to(move[:, None], (*deviation.shape[:2], 2, 1))
    taken = np.concatenate([moves, deviation], axis=2).astype(np.float32)
    predicted += (taken.swapaxes(2, 3) @ by_ball)[:, :, 0].transpose(1, 0, 2)
    off = residuals(predicted, pixels.change, pixels.precision, pixels.saturated)
    variance = np.diagonal(inverse, axis1=2, axis2=3)
    expected = tail * deviation[..., 0] ** 2 + variance
    return [
        FittedCentre(
            ball.start + move[i, :, 0],
            sums[i] @ sums[i].T,
            deviation[i, ..., 0].T,
            expected[i].T,
            quantile(off[i, : ball.samples.xy.shape[1]], 0.5),
        )
        for i, ball in enumerate(balls)
    ]


@dataclass(frozen=True, eq=False)
class _Pixels:
    """Pixels of B balls, as many for each: those that a ball lacks have no weight.

    Attributes
    ----------
    place, offset, normal : (2, B, N) float32
        Position, offset from the centre in ball radii, and normal of the surface there.
    turn : (3, B, N) float32
        Derivatives of the normal by the offset.
    ball : (B, 1) float32
        Radius of the ball.
    change, precision, saturated : (K, B, N)
    """

    place: Float32
    offset: Float32
    normal: Float32
    turn: Float32
    ball: Float32
    change: Float32
    precision: Float32
    saturated: Bool

    @classmethod
    def from_balls(cls, balls: Sequence[BallPixels]) -> Self:
        samples = [ball.samples for ball in balls]
        size = len(balls), max(s.xy.shape[1] for s in samples)
        place, offset, normal = np.zeros((3, 2, *size), np.float32)
        turn = np.zeros((3, *size), np.float32)
        change, precision = np.zeros((2, len(samples[0].change), *size), np.float32)
        saturated = np.zeros(change.shape, np.bool_)
        for i, ball in enumerate(balls):
            s = ball.samples
            part = np.s_[:, i, : s.xy.shape[1]]
            place[part], change[part], precision[part] = s.place, s.change, s.precision
            saturated[part] = s.saturated
            offset[part] = (s.xy - ball.start[:, None]) / ball.ball
            normal[part], turn[part] = ball.shape.normal(offset[part])
        radii = np.array([[ball.ball] for ball in balls], np.float32)
        return cls(place, offset, normal, turn, radii, change, precision, saturated)

    def linearise_change(self, light: LightModel) -> tuple[Float32, Float32]:
        """Predicted change (K, B, N), and its derivatives (K, 2 + S, B, N).

        The derivatives are by the centre and by the light's coefficients.
        """
        shape = self.change.shape
        here = light.light_at(self.place.reshape(2, -1))
        slopes, *by_normal = here.slopes_and_derivatives(self.normal.reshape(2, -1))
        by_x, by_y = (here.of_slopes(by).reshape(shape) / -self.ball for by in by_normal)
        columns = np.empty((len(by_x), 2 + len(slopes), *shape[1:]), np.float32)
        columns[:, 0] = by_x * self.turn[0] + by_y * self.turn[1]
        columns[:, 1] = by_x * self.turn[1] + by_y * self.turn[2]
        columns[:, 2:] = slopes.reshape(-1, *shape[1:])
        return here.of_slopes(slopes).reshape(shape), columns

    def by_sector(self, pulls: Float32, move: Float64) -> Float64:
        """Sums (B, 2, G) of (2, B, N) over the sectors about the centres after a move (B, 2)."""
        x, y = self.offset - (move.T[..., None] / self.ball).astype(np.float32)
        angle = np.arctan2(y, x) / np.float32(2 * np.pi) + np.float32(0.5)
        sector = np.minimum(angle * CENTRE.sectors, CENTRE.sectors - 1).astype(np.intp)
        sector += CENTRE.sectors * np.arange(len(sector))[:, None]
        count = CENTRE.sectors * len(sector)
        sums = [np.bincount(sector.ravel(), pull.ravel(), count) for pull in pulls]
        return np.stack([each.reshape(-1, CENTRE.sectors) for each in sums], axis=1)
