"""The forward light: the colour change that a normal at a place gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import terms
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.press import Change

RIDGE = 1e-4
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixels on balls: place, normal, change, and which channels are saturated."""

    xy: Float64
    normal: Float64
    change: Float64
    full: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Light:
    """A polynomial in (nx, ny) without a constant, whose coefficients vary over the image.

    Level skin keeps its colour, which is what pins the centres absolutely.

    Attributes
    ----------
    coefficients : (S · P, K) float64
    slope_order, place_order : int
    shape : (h, w)
        Of the working image.
    scale : float
        Working pixels per pixel.
    residual : float
        Median misfit, on a scale of 255.
    """

    coefficients: Float64
    slope_order: int
    place_order: int
    shape: tuple[int, int]
    scale: float
    residual: float = 1.0

    def at(self, xy: Float64) -> LocalLight:
        """Light at working places (N, 2), for many normals there."""
        places = _places(xy, self.shape, self.place_order)
        by_slope = self.coefficients.reshape(-1, places.shape[1], self.coefficients.shape[1])
        return LocalLight(np.einsum("np,spk->nsk", places, by_slope), self.slope_order)


@dataclass(frozen=True, eq=False)
class LocalLight:
    """The light at some places.

    Attributes
    ----------
    coefficients : (N, S, K) float64
        Of the products of nx and ny, by their degree.
    slope_order : int
    """

    coefficients: Float64
    slope_order: int

    def __call__(self, normal: Float64) -> Float64:
        """(N, K) change for normals (N, 2), the sines of the slope."""
        slopes = _slopes(normal, self.slope_order)
        return np.asarray(np.einsum("ns,nsk->nk", slopes, self.coefficients))

    def along(self, direction: Float64) -> Float64:
        """(T, N, K) coefficients of the powers of the sine, from the first on, in directions."""
        products = _slopes(direction, self.slope_order)[:, :, None] * self.coefficients
        ends = np.cumsum([0, *(degree + 1 for degree in range(1, self.slope_order + 1))])
        return np.stack([products[:, a:b].sum(1) for a, b in pairwise(ends)])


def orders_for(presses: int) -> tuple[int, int]:
    """Slope and place order that so many presses determine."""
    if presses < 4:
        return 2, 0
    return (3, 1) if presses < 12 else (3, 2)


def samples_on(change: Change, centre: Float64, radius: float, ball_radius: float) -> Samples:
    """Pixels within ``radius`` of a ball's centre, with the ball's normals there."""
    x, y = change.disc(centre, radius)
    xy = np.stack([x, y], 1).astype(np.float64)
    return Samples(xy, (xy - centre) / ball_radius, change.values[y, x], change.full[y, x])


def fit(
    samples: Sequence[Samples], shape: tuple[int, int], scale: float, orders: tuple[int, int]
) -> Light:
    """Fit the light to balls at known centres, robustly.

    A saturated channel says "at least": it counts only where the light falls short of it.
    """
    xy, normal, change, full = (
        np.concatenate([getattr(s, name) for s in samples])
        for name in ("xy", "normal", "change", "full")
    )
    slopes, places = _slopes(normal, orders[0]), _places(xy, shape, orders[1])
    products = (slopes[:, :, None] * places[:, None, :]).reshape(len(xy), -1)
    weight = np.ones(len(products))
    coefficients = np.zeros((products.shape[1], change.shape[1]))
    penalty = RIDGE * len(products) * np.eye(products.shape[1])
    residual = 1.0
    for _ in range(_ROUNDS):
        weighted = products * weight[:, None]
        square, mixed = weighted.T @ products + penalty, weighted.T @ change
        for k in range(change.shape[1]):
            # Few pixels are saturated: what they take away is less work than what the others give.
            out = full[:, k] & (products @ coefficients[:, k] >= change[:, k])
            without = weighted[out].T
            coefficients[:, k] = np.linalg.solve(
                square - without @ products[out], mixed[:, k] - without @ change[out, k]
            )
        misfit = misfits(products @ coefficients, change, full)
        residual = float(np.median(misfit))
        weight = 1 / (1 + (misfit / (3 * residual + 1e-9)) ** 2)
    return Light(coefficients, *orders, shape, scale, residual)


def misfits(predicted: Float64, change: Float64, full: NDArray[np.bool_]) -> Float64:
    """(N,) length of the misfit, which a saturated channel has only where light falls short."""
    error = predicted - change
    error[full & (error > 0)] = 0
    return np.asarray(np.sqrt((error * error).sum(1)))


def _slopes(normal: Float64, order: int) -> Float64:
    """(N, S) products of nx and ny, by their degree from 1 on."""
    return terms(normal, order)[:, 1:]


def _places(xy: Float64, shape: tuple[int, int], order: int) -> Float64:
    """(N, P) products of the place, which runs from −1 to 1 across."""
    h, w = shape
    return terms((xy - (w / 2, h / 2)) / (w / 2), order)
