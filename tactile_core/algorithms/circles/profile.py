"""Slope of the gel surface against the distance from the centre of a press, under a known light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.light import Light
from tactile_core.algorithms.circles.press import Change


class ProfileParameters(NamedTuple):
    """Parameters of the measurement of profiles.

    Nothing sets them from outside: they are relative to the radius of the ball or the residuals.

    Attributes
    ----------
    smallest, largest : float, ball radii
        Range of the profile. Nearer to the centre the surface is that of the ball.
        Source: the smallest contact of interest, and far enough outside the largest to see it end.
    step : float, ball radii
        Spacing of its nodes.
        Source: chosen by hand: two standard deviations of the smoothing of the image.
    least_step_px : float, working px
        Lower bound of the spacing.
        Source: mathematics; the pixels do not resolve less.
    trials : tuple of float, ratio
        Sines among which the first estimate is chosen.
        Source: chosen by hand; no script derives it.
    rounds : int, count
        Gauss–Newton steps.
        Source: chosen by hand; no script derives it.
    sectors : int, count
        Sectors of the disc; each is left out once.
        Source: chosen by hand: an attached shadow is about as wide.
    smoothness : float, ratio
        Weight of the bend of the profile, over the mean weight of a node. It bridges nodes whose
        pixels are hidden.
        Source: chosen by hand; no script derives it.
    steepest_sine : float, ratio
        Upper bound of the sine of the slope.
        Source: chosen by hand, just below 1; no script derives it.
    least_residual : float, logarithm of the intensity
        Lower bound of the residual scale of the soft-L1 weights.
        Source: chosen by hand; no script derives it.
    most_pixels, fewest_pixels : int, count
        Pixels that are drawn at random, and below which there is no profile.
        Source: chosen by hand; no script derives it.
    """

    smallest: float = 0.25
    largest: float = 1.4
    step: float = 0.05
    least_step_px: float = 1.0
    trials: tuple[float, ...] = (-0.3, -0.1, 0.1, 0.25, 0.4, 0.6, 0.8, 1.0)
    rounds: int = 4
    sectors: int = 12
    smoothness: float = 0.003
    steepest_sine: float = 0.999
    least_residual: float = 0.005
    most_pixels: int = 2500
    fewest_pixels: int = 30


PROFILE = ProfileParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class RadialProfile:
    """Slope along the radius, linear between nodes.

    Attributes
    ----------
    r : (J,) float64
        Distances of the nodes from the centre, ball radii.
    sines : (J,) float64
        Sine of the slope there.
    without : (G, J) float64
        The same without the pixels of each sector.
    """

    r: Float64
    sines: Float64
    without: Float64


def radial_profile(
    change: Change, light: Light, deviation: Float64, centre: Float64, ball: float
) -> RadialProfile | None:
    """Measure the profile of a press by Gauss–Newton with soft-L1 weights.

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
    ball : float
        Radius of the ball, in working pixels.

    Returns
    -------
    RadialProfile or None
        None where too few pixels are visible.
    """
    pixels = _Pixels.of(change, light, deviation, centre, ball)
    if pixels is None:
        return None
    step = max(PROFILE.step, PROFILE.least_step_px / ball)
    last = int((PROFILE.largest - PROFILE.smallest) / step) + 1
    nodes = PROFILE.smallest + step * np.arange(last + 1, dtype=np.float64)
    left = ((pixels.r - nodes[0]) / step).astype(np.intp)
    share = (pixels.r - nodes[left]) / step

    def sums(values: Float64, at: NDArray[np.intp]) -> Float64:
        size = PROFILE.sectors * len(nodes)
        flat = np.bincount(pixels.sector * len(nodes) + at, values, size)
        return np.asarray(flat.reshape(PROFILE.sectors, -1))

    costs = [
        sums(pixels.linearised(np.full_like(pixels.r, trial))[2], left).sum(0)
        for trial in PROFILE.trials
    ]
    sines: Float64 = np.asarray(PROFILE.trials)[np.argmin(costs, axis=0)]
    for _ in range(PROFILE.rounds):
        sine = (1 - share) * sines[left] + share * sines[left + 1]
        curve, pull, _ = pixels.linearised(sine)
        pull = curve * sine - pull
        systems = np.stack(
            [
                sums(curve * (1 - share) ** 2, left) + sums(curve * share**2, left + 1),
                sums(curve * share * (1 - share), left),
                sums(pull * (1 - share), left) + sums(pull * share, left + 1),
            ]
        )
        whole = systems.sum(1)
        sines = _solved(whole)
    without = np.stack([_solved(whole - part) for part in systems.transpose(1, 0, 2)])
    return RadialProfile(nodes, sines, without)


@dataclass(frozen=True, eq=False)
class _Pixels:
    """Pixels around a press; along its direction the light of each is a polynomial in the sine."""

    r: Float64
    sector: NDArray[np.intp]
    powers: Float64
    seen: Float64
    precision: Float64
    saturated: NDArray[np.bool_]
    unit: float

    @classmethod
    def of(
        cls, change: Change, light: Light, deviation: Float64, centre: Float64, ball: float
    ) -> _Pixels | None:
        x, y = change.disc(centre, PROFILE.largest * ball)
        r = np.hypot(x - centre[0], y - centre[1]) / ball
        pick = np.flatnonzero(r >= PROFILE.smallest)
        pick = np.random.default_rng(0).permutation(pick)[: PROFILE.most_pixels]
        if len(pick) < PROFILE.fewest_pixels:
            return None
        x, y, r = x[pick], y[pick], r[pick]
        xy = np.stack([x, y], 1).astype(np.float64)
        direction = (xy - centre) / (r * ball)[:, None]
        turn = np.arctan2(direction[:, 1], direction[:, 0]) / (2 * np.pi) + 0.5
        return cls(
            r,
            np.minimum(turn * PROFILE.sectors, PROFILE.sectors - 1).astype(np.intp),
            light.at(change.place(xy)).plus(deviation).along(direction),
            change.values[y, x],
            change.precision[y, x],
            change.saturated[y, x],
            max(light.residual, PROFILE.least_residual),
        )

    def linearised(self, sine: Float64) -> tuple[Float64, Float64, Float64]:
        """Curvature and derivative of the cost of each pixel by its sine, and the cost, (N,)."""
        s = sine[:, None]
        # Horner's scheme for the polynomial and its derivative; it has no constant.
        value, slope = np.zeros_like(self.seen), np.zeros_like(self.seen)
        for coefficients in [*self.powers[::-1], 0.0]:
            slope = slope * s + value
            value = value * s + coefficients
        error = value - self.seen
        # A saturated channel is a lower bound.
        above = self.saturated & (error > 0)
        error[above] = 0
        slope[above] = 0
        square = np.einsum("nk,nk,nk->n", self.precision, error, error)
        cost = np.sqrt(1 + square / self.unit**2)
        weight = self.precision / (self.unit**2 * cost[:, None])
        return (weight * slope**2).sum(1), (weight * slope * error).sum(1), cost


def _solved(system: Float64) -> Float64:
    """Solve for the sines at the nodes: diagonal, next to it, and right side, (3, J)."""
    diagonal, beside, right = system
    bend = np.diff(np.eye(len(diagonal)), 2, axis=0)
    normal = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    normal += PROFILE.smoothness * diagonal.mean() * bend.T @ bend
    limit = PROFILE.steepest_sine
    return np.asarray(np.clip(np.linalg.solve(normal, right), -limit, limit), np.float64)
