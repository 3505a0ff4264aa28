"""The forward light: the colour change that a normal at a place gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.circles.press import Change

Float = NDArray[np.float64]

RIDGE = 1e-4
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixels on balls: place, normal, change, and which channels are saturated."""

    xy: Float
    normal: Float
    change: Float
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

    coefficients: Float
    slope_order: int
    place_order: int
    shape: tuple[int, int]
    scale: float
    residual: float = 1.0

    def __call__(self, xy: Float, normal: Float) -> Float:
        """(N, K) change at working places (N, 2) for normals (N, 2), the sines of the slope."""
        return self._terms(xy, normal) @ self.coefficients

    def _terms(self, xy: Float, normal: Float) -> Float:
        return _terms(xy, normal, self.shape, self.slope_order, self.place_order)


def orders_for(presses: int) -> tuple[int, int]:
    """Slope and place order that so many presses determine."""
    if presses < 4:
        return 2, 0
    return (3, 1) if presses < 12 else (3, 2)


def samples_on(change: Change, centre: Float, radius: float, ball_radius: float) -> Samples:
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
    terms = _terms(xy, normal, shape, *orders)
    weight = np.ones(len(terms))
    coefficients = np.zeros((terms.shape[1], change.shape[1]))
    penalty = RIDGE * len(terms) * np.eye(terms.shape[1])
    residual = 1.0
    for _ in range(_ROUNDS):
        for k in range(change.shape[1]):
            counts = weight * (~full[:, k] | (terms @ coefficients[:, k] < change[:, k]))
            weighted = terms * counts[:, None]
            coefficients[:, k] = np.linalg.solve(
                weighted.T @ terms + penalty, weighted.T @ change[:, k]
            )
        misfit = misfits(terms @ coefficients, change, full)
        residual = float(np.median(misfit))
        weight = 1 / (1 + (misfit / (3 * residual + 1e-9)) ** 2)
    return Light(coefficients, *orders, shape, scale, residual)


def misfits(predicted: Float, change: Float, full: NDArray[np.bool_]) -> Float:
    """(N,) length of the misfit, which a saturated channel has only where light falls short."""
    error = predicted - change
    error[full & (error > 0)] = 0
    return np.asarray(np.sqrt((error * error).sum(1)))


def _terms(
    xy: Float, normal: Float, shape: tuple[int, int], slope_order: int, place_order: int
) -> Float:
    h, w = shape
    u, v = (xy[:, 0] - w / 2) / (w / 2), (xy[:, 1] - h / 2) / (w / 2)
    nx, ny = normal[:, 0], normal[:, 1]
    slope = np.stack(
        [nx**a * ny ** (t - a) for t in range(1, slope_order + 1) for a in range(t + 1)], 1
    )
    place = np.stack(
        [u**a * v**b for a in range(place_order + 1) for b in range(place_order + 1 - a)], 1
    )
    return (slope[:, :, None] * place[:, None, :]).reshape(len(xy), -1)
