"""Numbers from the displacement of pins: a quadratic regression that knows its errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.regression import degrees, terms
from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import CalibrationError

FEWEST = 50  # [count] Fewest presses: with 60 of the recorded ones errors are half as large again
# [count] Patterns of displacement. Source: recorded presses; with 6 the angle is a third worse,
# with 24 distance and angle are
_PATTERNS = 12
_ORDER = 2  # Source: recorded presses; linear in twice the patterns, the angle is half as large again
_NOISE_PX = 0.05  # [px] Error of a pin's position: a weaker pattern is not amplified to full size
_ROUNDS = 10  # [count] 30 give the same
_NEIGHBOURS = 1 / 8  # [share of the presses] that tell the size of the errors at one level
_FLAT = 1e-6  # Precision of the prior of a constant: none


@dataclass(frozen=True, eq=False)
class PinRegression:
    """A polynomial in the main patterns of displacement, with the covariance of its weights.

    Attributes
    ----------
    mean : (P,) float64
        Mean displacement of the fitted presses: x and y of each pin in turn, px.
    patterns : (P, K) float64
        Principal patterns, scaled to unit variance, 1 / px.
    weights : (T, M) float64
        Of each term of the polynomial, for each of M numbers.
    covariance : (M, T, T) float64
        Of the weights.
    levels : (N,) float64
        Increasing values of the first number, scaled, at which the noise is known.
    noise : (N, M) float64
        Variance of each scaled number at these levels.
    centre, scale : (M,) float64
        Mean and standard deviation of the numbers.
    """

    mean: Float64
    patterns: Float64
    weights: Float64
    covariance: Float64
    levels: Float64
    noise: Float64
    centre: Float64
    scale: Float64

    def __post_init__(self) -> None:
        (pins, patterns), (count, numbers) = self.patterns.shape, self.weights.shape
        shapes = {
            "mean": (pins,),
            "covariance": (numbers, count, count),
            "levels": (len(self.levels),),
            "noise": (len(self.levels), numbers),
            "centre": (numbers,),
            "scale": (numbers,),
        }
        wrong = [name for name, shape in shapes.items() if getattr(self, name).shape != shape]
        if wrong or len(degrees(patterns, _ORDER)) != count or not len(self.levels):
            raise ValueError(f"the shape of {', '.join(wrong) or 'weights'} does not match")
        if not all(np.isfinite(array).all() for array in vars(self).values()):
            raise ValueError("not all numbers are finite")

    def predict(self, moved_px: Float64) -> tuple[Float64, Float64]:
        """Return the numbers (N, M) of displacements (N, P), and their standard deviations."""
        given = terms((moved_px - self.mean) @ self.patterns, _ORDER)
        found = given @ self.weights
        of_weights = np.einsum("nt,mtu,nu->nm", given, self.covariance, given)
        std = np.sqrt(of_weights + _at_levels(found[:, 0], self.levels, self.noise))
        return found * self.scale + self.centre, std * self.scale

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays for :meth:`from_arrays`, by name."""
        return dict(vars(self))

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild a regression from its arrays.

        Raises
        ------
        KeyError, ValueError
            An array is missing, or does not match the others.
        """
        names = cls.__dataclass_fields__
        return cls(**{name: np.asarray(arrays[name], np.float64) for name in names})


def fit_regression(moved_px: Float64, numbers: Float64) -> PinRegression:
    """Fit the numbers of presses to the displacement of the pins.

    The displacements are reduced to their principal components, and the numbers are a polynomial
    in these: linear Bayesian regression with one prior for each degree. The strength of the priors
    maximises the evidence [1]_. The noise differs between presses: a surface that hardly touches
    moves no pin and leaves its distance open. Its variance is the local mean of the squared
    residuals, over the presses whose first number is predicted most alike; a residual is corrected
    for the share of it that the fit has absorbed.

    Parameters
    ----------
    moved_px : (N, P) float64
        Displacement of the pins in each press.
    numbers : (N, M) float64
        What was measured; the noise of all depends on the first.

    Raises
    ------
    CalibrationError
        There are too few presses, the pins do not move, or a number is the same in all presses.

    References
    ----------
    .. [1] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4(3), 1992.
    """
    if len(moved_px) < FEWEST:
        raise CalibrationError(
            f"{len(moved_px)} presses do not determine a regression; label at least {FEWEST}, "
            f"better 400, at all distances and angles that are to be measured"
        )
    centre, scale = numbers.mean(axis=0), numbers.std(axis=0)
    mean = moved_px.mean(axis=0)
    _, size, across = np.linalg.svd(moved_px - mean, full_matrices=False)
    size /= np.sqrt(len(moved_px))
    if not scale.all() or size[0] < _NOISE_PX:
        what = "the pins do not move" if scale.all() else "a label is the same in all of them"
        raise CalibrationError(f"the presses do not differ: {what}")
    patterns = across[:_PATTERNS].T / np.hypot(size[:_PATTERNS], _NOISE_PX)
    given = terms((moved_px - mean) @ patterns, _ORDER)
    wanted = (numbers - centre) / scale
    degree = degrees(patterns.shape[1], _ORDER)
    precision = np.ones((len(scale), _ORDER + 1))
    precision[:, 0] = _FLAT
    noise = np.full(wanted.shape, 0.01)  # the first guess; any other ends the same
    weights, covariance = np.empty((given.shape[1], len(scale))), np.empty(0)
    for _ in range(_ROUNDS):
        fits = [
            _fit_number(given, wanted[:, m], noise[:, m], precision[m], degree)
            for m in range(len(scale))
        ]
        weights = np.stack([fit[0] for fit in fits], axis=1)
        covariance = np.stack([fit[1] for fit in fits])
        squares = np.stack([fit[2] for fit in fits], axis=1)
        precision = np.stack([fit[3] for fit in fits])
        level = given @ weights[:, 0]
        levels, known = _local_means(level, squares)
        noise = _at_levels(level, levels, known)
    return PinRegression(mean, patterns, weights, covariance, levels, known, centre, scale)


def _fit_number(
    given: Float64,
    wanted: Float64,
    noise: Float64,
    precision: Float64,
    degree: NDArray[np.intp],
) -> tuple[Float64, Float64, Float64, Float64]:
    """Weights, their covariance, squared residuals and the better precision of the priors."""
    prior = precision[degree]
    weighted = given.T / noise
    covariance = np.linalg.inv(weighted @ given + np.diag(prior))
    weights = covariance @ (weighted @ wanted)
    absorbed = np.einsum("nt,tu,nu->n", given, covariance, given) / noise
    # [share] a press that the fit can follow freely tells nothing
    squares = (wanted - given @ weights) ** 2 / np.maximum(1 - absorbed, 0.05)
    determined = 1 - prior * np.diag(covariance)
    better = precision.copy()
    for one in range(1, _ORDER + 1):
        of_degree = degree == one
        better[one] = determined[of_degree].sum() / max((weights[of_degree] ** 2).sum(), 1e-12)
    return weights, covariance, squares, better


def _local_means(level: Float64, squares: Float64) -> tuple[Float64, Float64]:
    """Sorted levels, and the mean (N, M) over the presses nearest in order; never quite 0."""
    count = len(level)
    order = np.argsort(level, kind="stable")
    reach = max(1, round(count * _NEIGHBOURS / 2))
    sums = np.concatenate([np.zeros((1, squares.shape[1])), np.cumsum(squares[order], axis=0)])
    low = np.maximum(np.arange(count) - reach, 0)
    high = np.minimum(np.arange(count) + reach + 1, count)
    means = (sums[high] - sums[low]) / (high - low)[:, None]
    return level[order], np.maximum(means, 1e-9)


def _at_levels(level: Float64, levels: Float64, noise: Float64) -> Float64:
    return np.stack([np.interp(level, levels, one) for one in noise.T], axis=1)
