"""Forward model of the light: colour change as a function of normal and position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import terms
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import Change


class LightParameters(NamedTuple):
    """Parameters of the fit of the light.

    Nothing sets them from outside: the number of presses decides the orders.

    Attributes
    ----------
    ridge : float, per sample
        Penalty on the coefficients. Mean squares of cubic terms are about 1e-4: a penalty of that
        size shrinks them, and all centres move together.
        Source: virtual units (``experiments/circle_finding.py``), among 1e-7 to 1e-4.
    rounds : int, count
        Reweightings.
        Source: chosen by hand; no script derives it.
    cauchy_residuals : float, median residuals
        Scale of the Cauchy weights.
        Source: chosen by hand; no script derives it.
    few_presses, many_presses : int, count
        Below the first the model is quadratic in the normal and uniform over the image; from the
        second on it is quadratic in the position.
        Source: chosen by hand; no script derives it.
    most_pixels : int, count
        Pixels per press that are drawn at random for the fit.
        Source: chosen by hand: about one per area over which the noise is correlated.
    first_spread : float, ratio
        Deviation of a press from the light, relative to its coefficients, until it is known.
        Source: chosen by hand; no script derives it.
    """

    ridge: float = 1e-5
    rounds: int = 4
    cauchy_residuals: float = 3
    few_presses: int = 4
    many_presses: int = 12
    most_pixels: int = 400
    first_spread: float = 0.5


LIGHT = LightParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixels on balls.

    Attributes
    ----------
    xy : (N, 2) float64
        Position in working pixels.
    place : (N, 2) float64
        The same relative to half the width of the image, from its middle.
    normal : (N, 2) float64
        x and y components of the unit normal.
    change : (N, K) float64
        Change of the image.
    precision : (N, K) float64
        Weight of the change, 0 to 1.
    saturated : (N, K) bool
        The channel is saturated: the change is a lower bound.
    """

    xy: Float64
    place: Float64
    normal: Float64
    change: Float64
    precision: Float64
    saturated: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Light:
    """Polynomial in (nx, ny) without a constant, whose coefficients vary over the image.

    A flat surface keeps its colour, so the constant is 0; this fixes the centres absolutely.

    Attributes
    ----------
    coefficients : (S · P, K) float64
    slope_order, place_order : int
        Degree in the normal and in the position.
    darkens : bool
        It describes the gradient of an image that darkens with depth, instead of light from the
        sides.
    residual : float
        Median residual.
    spread : (S, K) float64
        Standard deviation by which the coefficients of a place deviate from the polynomial of the
        position.
    """

    coefficients: Float64
    slope_order: int
    place_order: int
    darkens: bool
    residual: float
    spread: Float64

    def at(self, place: Float64) -> LocalLight:
        """Evaluate the coefficients at (N, 2) places, for many normals there."""
        places = terms(place, self.place_order)
        by_slope = self.coefficients.reshape(-1, places.shape[1], self.coefficients.shape[1])
        return LocalLight(np.einsum("np,spk->nsk", places, by_slope), self.slope_order)


@dataclass(frozen=True, eq=False)
class LocalLight:
    """The light at N places.

    Attributes
    ----------
    coefficients : (N, S, K) float64
        Coefficients of the products of nx and ny, sorted by degree.
    slope_order : int
    """

    coefficients: Float64
    slope_order: int

    def __call__(self, normal: Float64) -> Float64:
        """Predict the colour change (N, K) for the components (N, 2) of unit normals."""
        return self.of_slopes(self.slopes(normal))

    def of_slopes(self, slopes: Float64) -> Float64:
        """Predict the change (N, K) for the products (N, S) of :meth:`slopes`."""
        return np.asarray(np.einsum("ns,nsk->nk", slopes, self.coefficients))

    def slopes(self, normal: Float64) -> Float64:
        """Products of nx and ny, (N, S), sorted by degree from 1 on."""
        return terms(normal, self.slope_order)[:, 1:]

    def plus(self, deviation: Float64) -> LocalLight:
        """Add (S, K) to the coefficients of every place."""
        return LocalLight(self.coefficients + deviation, self.slope_order)

    def along(self, direction: Float64) -> Float64:
        """Coefficients of the powers 1 … T of the sine of the slope along directions, (T, N, K)."""
        products = self.slopes(direction)[:, :, None] * self.coefficients
        ends = np.cumsum([0, *(degree + 1 for degree in range(1, self.slope_order + 1))])
        return np.stack([products[:, a:b].sum(1) for a, b in pairwise(ends)])


def samples_on(
    change: Change, centre: Float64, radius: float, ball_radius: float, most: int
) -> Samples:
    """Collect pixels within ``radius`` of the centre of a ball, with the ball's normals."""
    x, y = change.disc(centre, radius)
    keep = np.random.default_rng(0).permutation(len(x))[:most]
    x, y = x[keep], y[keep]
    xy = np.stack([x, y], 1).astype(np.float64)
    normal = (xy - centre) / ball_radius
    values, precision, saturated = change.values, change.precision, change.saturated
    place = change.place(xy)
    return Samples(xy, place, normal, values[y, x], precision[y, x], saturated[y, x])


def fit(samples: Sequence[Samples], orders: tuple[int, int], *, darkens: bool) -> Light:
    """Fit the light to balls at known centres by reweighted least squares with Cauchy weights.

    A saturated channel is a lower bound: it counts only where the prediction is below it.

    Parameters
    ----------
    samples : sequence of Samples
        One per ball.
    orders : (int, int)
        Degrees in the normal and in the position.
    darkens : bool
        As in :class:`Light`.

    References
    ----------
    .. [1] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics – Theory and Methods 6(9), 1977.
    """
    place, normal, change, precision, saturated = (
        np.concatenate([getattr(s, name) for s in samples])
        for name in ("place", "normal", "change", "precision", "saturated")
    )
    slopes, places = terms(normal, orders[0])[:, 1:], terms(place, orders[1])
    products = (slopes[:, :, None] * places[:, None, :]).reshape(len(place), -1)
    weight = np.ones(len(products))
    coefficients = np.zeros((products.shape[1], change.shape[1]))
    penalty = LIGHT.ridge * len(products) * np.eye(products.shape[1])
    residual = 1.0
    for _ in range(LIGHT.rounds):
        for k in range(change.shape[1]):
            out = saturated[:, k] & (products @ coefficients[:, k] >= change[:, k])
            weighted = products * (weight * precision[:, k] * ~out)[:, None]
            coefficients[:, k] = np.linalg.solve(
                weighted.T @ products + penalty, weighted.T @ change[:, k]
            )
        length = residuals(products @ coefficients, change, precision, saturated)
        residual = float(np.median(length))
        weight = 1 / (1 + (length / (LIGHT.cauchy_residuals * residual + 1e-9)) ** 2)
    # Half of the coefficients themselves, until the deviations of the presses are known.
    by_slope = np.einsum(
        "np,spk->nsk",
        places[:: LIGHT.most_pixels],
        coefficients.reshape(slopes.shape[1], places.shape[1], -1),
    )
    spread = LIGHT.first_spread * np.sqrt((by_slope**2).mean(0))
    return Light(coefficients, *orders, darkens, residual, spread)


def residuals(
    predicted: Float64, change: Float64, precision: Float64, saturated: NDArray[np.bool_]
) -> Float64:
    """Length of the weighted residual, (N,).

    Saturated channels count only where predicted too low.
    """
    error = predicted - change
    error[saturated & (error > 0)] = 0
    return np.asarray(np.sqrt((precision * error * error).sum(1)))


def orders_for(presses: int) -> tuple[int, int]:
    """Degrees in the normal and in the position that this number of presses determines."""
    if presses < LIGHT.few_presses:
        return 2, 0
    return (3, 1) if presses < LIGHT.many_presses else (3, 2)
