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
        Penalty on the coefficients.
        Source: chosen by hand; no script derives it.
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
    """

    ridge: float = 1e-4
    rounds: int = 4
    cauchy_residuals: float = 3
    few_presses: int = 4
    many_presses: int = 12


LIGHT = LightParameters()
"""The values in use."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixels on balls.

    Attributes
    ----------
    xy : (N, 2) float64
        Position in working pixels.
    normal : (N, 2) float64
        x and y components of the unit normal.
    change : (N, K) float64
        Colour change, in grey levels of 8 bits.
    saturated : (N, K) bool
        The channel is saturated: the change is a lower bound.
    """

    xy: Float64
    normal: Float64
    change: Float64
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
    shape : (h, w)
        Shape of the working image.
    scale : float
        Working pixels per pixel.
    residual : float
        Median residual, in grey levels of 8 bits.
    """

    coefficients: Float64
    slope_order: int
    place_order: int
    shape: tuple[int, int]
    scale: float
    residual: float = 1.0

    def at(self, xy: Float64) -> LocalLight:
        """Evaluate the coefficients at (N, 2) working pixels, for many normals there."""
        places = _places(xy, self.shape, self.place_order)
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
        slopes = _slopes(normal, self.slope_order)
        return np.asarray(np.einsum("ns,nsk->nk", slopes, self.coefficients))

    def along(self, direction: Float64) -> Float64:
        """Coefficients of the powers 1 … T of the sine of the slope along directions, (T, N, K)."""
        products = _slopes(direction, self.slope_order)[:, :, None] * self.coefficients
        ends = np.cumsum([0, *(degree + 1 for degree in range(1, self.slope_order + 1))])
        return np.stack([products[:, a:b].sum(1) for a, b in pairwise(ends)])


def orders_for(presses: int) -> tuple[int, int]:
    """Degrees in the normal and in the position that this number of presses determines."""
    if presses < LIGHT.few_presses:
        return 2, 0
    return (3, 1) if presses < LIGHT.many_presses else (3, 2)


def samples_on(change: Change, centre: Float64, radius: float, ball_radius: float) -> Samples:
    """Collect the pixels within ``radius`` of the centre of a ball, with the ball's normals."""
    x, y = change.disc(centre, radius)
    xy = np.stack([x, y], 1).astype(np.float64)
    return Samples(xy, (xy - centre) / ball_radius, change.values[y, x], change.saturated[y, x])


def fit(
    samples: Sequence[Samples], shape: tuple[int, int], scale: float, orders: tuple[int, int]
) -> Light:
    """Fit the light to balls at known centres by reweighted least squares with Cauchy weights.

    A saturated channel is a lower bound: it counts only where the prediction is below it.

    Parameters
    ----------
    samples : sequence of Samples
        One per ball.
    shape : (h, w)
        Shape of the working image.
    scale : float
        Working pixels per pixel.
    orders : (int, int)
        Degrees in the normal and in the position.

    References
    ----------
    .. [1] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics – Theory and Methods 6(9), 1977.
    """
    xy, normal, change, saturated = (
        np.concatenate([getattr(s, name) for s in samples])
        for name in ("xy", "normal", "change", "saturated")
    )
    slopes, places = _slopes(normal, orders[0]), _places(xy, shape, orders[1])
    products = (slopes[:, :, None] * places[:, None, :]).reshape(len(xy), -1)
    weight = np.ones(len(products))
    coefficients = np.zeros((products.shape[1], change.shape[1]))
    penalty = LIGHT.ridge * len(products) * np.eye(products.shape[1])
    residual = 1.0
    for _ in range(LIGHT.rounds):
        weighted = products * weight[:, None]
        square, mixed = weighted.T @ products + penalty, weighted.T @ change
        for k in range(change.shape[1]):
            # Few pixels are saturated: subtracting them is less work than summing the others.
            out = saturated[:, k] & (products @ coefficients[:, k] >= change[:, k])
            without = weighted[out].T
            coefficients[:, k] = np.linalg.solve(
                square - without @ products[out], mixed[:, k] - without @ change[out, k]
            )
        length = residuals(products @ coefficients, change, saturated)
        residual = float(np.median(length))
        weight = 1 / (1 + (length / (LIGHT.cauchy_residuals * residual + 1e-9)) ** 2)
    return Light(coefficients, *orders, shape, scale, residual)


def residuals(predicted: Float64, change: Float64, saturated: NDArray[np.bool_]) -> Float64:
    """Length of the residual, (N,). Saturated channels count only where predicted too low."""
    error = predicted - change
    error[saturated & (error > 0)] = 0
    return np.asarray(np.sqrt((error * error).sum(1)))


def _slopes(normal: Float64, order: int) -> Float64:
    """Products of nx and ny, (N, S), sorted by degree from 1 on."""
    return terms(normal, order)[:, 1:]


def _places(xy: Float64, shape: tuple[int, int], order: int) -> Float64:
    """Products of the position, (N, P); x runs from −1 to 1 across the image."""
    h, w = shape
    return terms((xy - (w / 2, h / 2)) / (w / 2), order)
