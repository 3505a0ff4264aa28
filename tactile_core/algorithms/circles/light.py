"""Forward model of the light: colour change as a function of normal and position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import quantile, terms
from tactile_core.algorithms.arrays.types import Bool, Float32, Float64
from tactile_core.algorithms.circles.press import PressChange


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixels on a ball, one per column.

    Attributes
    ----------
    xy : (2, N) float64
        Position in working pixels.
    place : (2, N) float32
        The same relative to half the width of the image, from its middle.
    normal : (2, N) float32
        x and y components of the unit normal.
    change : (K, N) float32
        Change of the image.
    precision : (K, N) float32
        Weight of the change, 0 to 1.
    saturated : (K, N) bool
        The channel is saturated: the change is a lower bound.
    """

    xy: Float64
    place: Float32
    normal: Float32
    change: Float32
    precision: Float32
    saturated: Bool


@dataclass(frozen=True, eq=False)
class LightModel:
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

    def light_at(self, place: Float32) -> LocalLight:
        """Evaluate the coefficients at (2, N) places, for many normals there."""
        places = terms(place.T, self.place_order).T
        count, channels = len(places), self.coefficients.shape[1]
        by_slope = self.coefficients.reshape(-1, count, channels).transpose(2, 0, 1)
        there = by_slope.reshape(-1, count).astype(np.float32) @ places
        return LocalLight(there.reshape(channels, -1, place.shape[1]), self.slope_order)


@dataclass(frozen=True, eq=False)
class LocalLight:
    """The light at N places.

    Attributes
    ----------
    coefficients : (K, S, N) float32
        Coefficients of the products of nx and ny, sorted by degree.
    slope_order : int
    """

    coefficients: Float32
    slope_order: int

    def of_slopes(self, slopes: Float32) -> Float32:
        """Predict the change (K, N) for the products (S, N) of :meth:`slopes`."""
        return np.asarray((self.coefficients * slopes).sum(1))

    def slopes(self, normal: Float32) -> Float32:
        """Products of the components (2, N) of unit normals, (S, N), from degree 1 on."""
        return terms(normal.T, self.slope_order).T[1:]

    def slopes_and_derivatives(self, normal: Float32) -> tuple[Float32, Float32, Float32]:
        """Return :meth:`slopes` and their derivatives by nx and by ny, (S, N) each."""
        products = terms(normal.T, self.slope_order).T
        by_x, by_y = (
            products[lower] * factor[:, None] for lower, factor in _derivatives(self.slope_order)
        )
        return products[1:], by_x, by_y


@cache
def _derivatives(order: int) -> tuple[tuple[NDArray[np.intp], Float32], ...]:
    """By nx and by ny: the product that each derivative is a multiple of, and the factor."""
    powers = [(degree - b, b) for degree in range(order + 1) for b in range(degree + 1)]
    number = {power: i for i, power in enumerate(powers)}
    by_x = [(number.get((a - 1, b), 0), a) for a, b in powers[1:]]
    by_y = [(number.get((a, b - 1), 0), b) for a, b in powers[1:]]
    return tuple(
        (np.array([i for i, _ in way], np.intp), np.array([f for _, f in way], np.float32))
        for way in (by_x, by_y)
    )


def samples_on(
    change: PressChange, centre: Float64, radius: float, ball_radius: float, most: int
) -> Samples:
    """Collect pixels within ``radius`` of the centre of a ball, with the ball's normals."""
    x, y = change.disc(centre, radius)
    keep = np.random.default_rng(0).permutation(len(x))[:most]
    xy = np.stack([x[keep], y[keep]]).astype(np.float64)
    normal = ((xy - centre[:, None]) / ball_radius).astype(np.float32)
    place = change.place(xy.T).T.astype(np.float32)
    return Samples(xy, place, normal, *change.values_at(x[keep], y[keep]))


def fit(
    samples: Sequence[Samples],
    orders: tuple[int, int],
    *,
    darkens: bool,
    before: LightModel | None = None,
) -> LightModel:
    """Fit the light to balls at known centres by reweighted least squares with Cauchy weights.

    A saturated channel is a lower bound: it counts only where the prediction is below it.

    Parameters
    ----------
    samples : sequence of Samples
        One per ball.
    orders : (int, int)
        Degrees in the normal and in the position.
    darkens : bool
        As in :class:`LightModel`.
    before : LightModel, optional
        The light of nearly these centres, at which the reweighting starts.

    References
    ----------
    .. [1] P. W. Holland and R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", Communications in Statistics – Theory and Methods 6(9), 1977.
    """
    place, normal, change, precision, saturated = (
        np.concatenate([getattr(s, name) for s in samples], axis=1)
        for name in ("place", "normal", "change", "precision", "saturated")
    )
    slopes, places = terms(normal.T, orders[0]).T[1:], terms(place.T, orders[1]).T
    products = (slopes[:, None] * places).reshape(-1, place.shape[1])
    count, pixels = products.shape
    # [per sample] Penalty on the coefficients. Mean squares of cubic terms are about 1e-4: a
    # penalty of that size shrinks them, and all centres move together. Source: virtual units
    # (``experiments/circle_finding.py``), among 1e-7 to 1e-4.
    penalty = 1e-5 * pixels * np.eye(count)
    coefficients = np.zeros((count, len(change)))
    # [reweightings] fewer where the light of nearly the same centres is known
    weight, residual, rounds = np.ones(pixels, np.float32), 1.0, 3
    predicted = np.zeros_like(change)
    if before is not None and before.coefficients.shape == coefficients.shape:
        coefficients, rounds = before.coefficients.copy(), 1
        predicted = coefficients.T.astype(np.float32) @ products
        residual, weight = _cauchy(residuals(predicted, change, precision, saturated))
    weighted = np.empty_like(products)
    for _ in range(rounds):
        for k in range(len(change)):
            out = saturated[k] & (predicted[k] >= change[k])
            root = np.sqrt(weight * precision[k] * ~out)
            np.multiply(products, root, out=weighted)
            normal_matrix = (weighted @ weighted.T).astype(np.float64) + penalty
            coefficients[:, k] = np.linalg.solve(normal_matrix, weighted @ (root * change[k]))
        predicted = coefficients.T.astype(np.float32) @ products
        residual, weight = _cauchy(residuals(predicted, change, precision, saturated))
    # Half of the coefficients themselves, until the deviations of the presses are known.
    by_slope = coefficients.reshape(len(slopes), len(places), -1)
    here = np.einsum("pn,spk->nsk", places[:, ::400], by_slope)
    # [ratio] Deviation of a press from the light, relative to its coefficients, until it is known.
    spread = 0.5 * np.sqrt((here**2).mean(0))
    return LightModel(coefficients, *orders, darkens, residual, spread)


def _cauchy(length: Float32) -> tuple[float, Float32]:
    """Median of the lengths of residuals, and the Cauchy weights (N,)."""
    residual = quantile(length, 0.5)
    # [median residuals] Scale of the Cauchy weights
    ratio = length / np.float32(3 * residual + 1e-9)
    return residual, np.asarray(1 / (1 + ratio * ratio), np.float32)


def residuals(predicted: Float32, change: Float32, precision: Float32, saturated: Bool) -> Float32:
    """Length of the weighted residual of (K, N) changes, (N,).

    Saturated channels count only where predicted too low.
    """
    error = predicted - change
    error[saturated & (error > 0)] = 0
    return np.asarray(np.sqrt((precision * error * error).sum(0)))


def orders_for(presses: int) -> tuple[int, int]:
    """Degrees in the normal and in the position that this number of presses determines."""
    if presses < 4:  # then quadratic in the normal, and uniform over the image
        return 2, 0
    return (3, 1) if presses < 12 else (3, 2)  # from 12 presses on quadratic in the position
