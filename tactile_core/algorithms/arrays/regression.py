"""Robust regression, quantiles, and the narrowest interval that holds a part of the values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations_with_replacement
from math import comb
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Array, Float32, Float64
from tactile_core.errors import CalibrationError

T = TypeVar("T", np.float32, np.float64)


@dataclass(frozen=True, eq=False)
class PolynomialFit:
    """A polynomial in scaled features.

    Attributes
    ----------
    mean, std : (D,) float32
        Scale of the features.
    coefficients : (T, M) float32
        One row per term of :func:`terms`.
    order : int
        Highest total degree.
    """

    mean: Float32
    std: Float32
    coefficients: Float32
    order: int

    def __call__(self, features: Float32) -> Float32:
        """Map (N, D) features to (N, M) outputs."""
        scaled = (features - self.mean) / self.std
        return np.asarray(terms(scaled, self.order) @ self.coefficients, np.float32)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays for :meth:`from_arrays`, by name."""
        return {
            "mean": self.mean,
            "std": self.std,
            "coefficients": self.coefficients,
            "order": np.array(self.order),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild a fit from its arrays.

        Raises
        ------
        KeyError
            An array is missing.
        ValueError
            Their shapes do not match.
        """
        fit = cls(arrays["mean"], arrays["std"], arrays["coefficients"], int(arrays["order"]))
        count = len(fit.mean)
        if not fit.mean.shape == fit.std.shape == (count,):
            raise ValueError("mean and std are not one number per feature")
        # No model has a higher order
        terms_ = comb(count + fit.order, count) if 0 <= fit.order <= 8 else None
        if fit.coefficients.ndim != 2 or len(fit.coefficients) != terms_:
            raise ValueError("the coefficients are not those of a polynomial of this order")
        return fit


def scaling(features: Float32) -> tuple[Float32, Float32]:
    """Mean and positive standard deviation, (D,) each, of (N, D) features."""
    return features.mean(0), features.std(0) + np.float32(1e-6)


def terms(scaled: NDArray[T], order: int) -> NDArray[T]:
    """Products of up to ``order`` features, (N, T), sorted by degree from the constant on."""
    features = np.ascontiguousarray(scaled.T)
    count = len(features)
    found = np.empty((comb(count + order, count), len(scaled)), scaled.dtype)
    found[0] = 1
    end = 1
    for last, product in _factors(count, order):
        np.multiply(features[last], found[product], out=found[end : end + len(last)])
        end += len(last)
    return found.T


@cache
def _factors(count: int, order: int) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]:
    """Factors of the terms of each degree: a feature, and a term of one degree less."""
    found = []
    products, end = [(0, 0)], 1
    for _ in range(order):
        # continuing from the last feature of a product yields each combination once
        pairs = [(feature, term) for last, term in products for feature in range(last, count)]
        products = [(feature, end + number) for number, (feature, _) in enumerate(pairs)]
        end += len(pairs)
        features, terms_ = np.array(pairs, np.intp).reshape(-1, 2).T
        found.append((features, terms_))
    return tuple(found)


def degrees(features: int, order: int) -> NDArray[np.intp]:
    """Degree of each of the (T,) terms of :func:`terms`."""
    counts = [comb(features + degree - 1, degree) for degree in range(order + 1)]
    return np.repeat(np.arange(order + 1), counts)


def place_factors(features: int, order: int) -> NDArray[np.intp]:
    """Number of positions in each of the (T,) terms of :func:`terms` that also has others.

    The last two features are the position; in terms of the position alone the number is 0.
    """
    counts = []
    for degree in range(order + 1):
        for term in combinations_with_replacement(range(features), degree):
            places = sum(feature >= features - 2 for feature in term)
            counts.append(places if places < degree else 0)
    return np.array(counts, np.intp)


def fit_polynomial(
    features: Float32,
    targets: Float32,
    *,
    order: int = 2,
    ridge: float = 1e-3,
    curvature_only: bool = False,
    variation: float = 0.0,
) -> PolynomialFit:
    """Fit a polynomial by ridge regression [1]_.

    Parameters
    ----------
    features : (N, D) float32
    targets : (N, M) float32
    order : int
        Highest total degree.
    ridge : float
        Penalty on the coefficients of scaled features, per sample.
    curvature_only : bool
        Penalise the square of the second derivative instead of that of the value, like a smoothing
        spline [2]_: a term of degree d counts (d (d − 1) / 2)², and planes are nearly free, so that
        they keep their slope. By default all terms count 1.
    variation : float
        Penalty, per sample, of what the response to the other features varies with the position,
        the last two features: each factor of the position in a term counts 1.

    Raises
    ------
    CalibrationError
        The samples do not determine the coefficients.

    References
    ----------
    .. [1] A. E. Hoerl and R. W. Kennard, "Ridge regression: biased estimation for nonorthogonal
       problems", Technometrics 12(1), 1970.
    .. [2] P. J. Green and B. W. Silverman, "Nonparametric Regression and Generalized Linear
       Models", Chapman and Hall, 1994.
    """
    mean, std = scaling(features)
    a = terms(((features - mean) / std).astype(np.float64), order)
    penalty = np.ones(a.shape[1])
    if curvature_only:
        degree = degrees(len(mean), order)
        penalty = np.maximum((degree * (degree - 1) / 2) ** 2, 1e-3)  # planes count little
    penalty *= ridge
    if variation:
        penalty += variation * place_factors(len(mean), order)
    normal = a.T @ a + len(a) * np.diag(penalty)
    try:
        coefficients = np.linalg.solve(normal, a.T @ targets.astype(np.float64))
    except np.linalg.LinAlgError:
        raise CalibrationError(
            "the images do not change with the known slopes, so no model can be fitted; "
            "check that the images, the reference and the circles belong together"
        ) from None
    return PolynomialFit(mean, std, coefficients.astype(np.float32), order)


ONE_SIGMA = math.erf(math.sqrt(0.5))  # Share of normal errors below one standard deviation


def quantile(values: NDArray[Any], share: float) -> float:
    """Quantile of (N,) finite values, interpolated linearly; ``share`` is from 0 to 1.

    Of 400 values it takes 4 µs, :func:`numpy.quantile` 40 µs.
    """
    place = share * (len(values) - 1)
    below = int(place)
    # one order statistic is vectorised, two at once are not
    ordered = np.partition(values, below)
    low = float(ordered[below])
    if place == below:
        return low
    return low + (place - below) * (float(ordered[below + 1 :].min()) - low)


def sigma_of(residuals: NDArray[Any]) -> float:
    """Robust standard deviation of (N,) residuals about 0, from their median absolute value.

    The factor makes it consistent for normal residuals [1]_.

    References
    ----------
    .. [1] F. R. Hampel, "The influence curve and its role in robust estimation", Journal of the
       American Statistical Association 69(346), 1974.
    """
    return 1.4826 * quantile(np.abs(residuals), 0.5)  # 1 / 0.6745, of a normal distribution


def narrowest(ordered: Array, count: int) -> tuple[NDArray[np.intp], Array]:
    """Find the narrowest interval that holds ``count`` values.

    With half of the values it is the shortest half, whose mean is the shorth [1]_.

    Parameters
    ----------
    ordered : (..., N)
        Values, sorted along the last axis.
    count : int
        Number of values in the interval, at most N.

    Returns
    -------
    first : (...) int
        Index of the first value in the interval.
    length : (...)
        Length of the interval.

    References
    ----------
    .. [1] D. F. Andrews et al., "Robust Estimates of Location: Survey and Advances", Princeton
       University Press, 1972.
    """
    last = ordered.shape[-1] - count
    lengths = ordered[..., count - 1 :] - ordered[..., : last + 1]
    return lengths.argmin(axis=-1), lengths.min(axis=-1)


def shorths(rows: Array) -> Array:
    """Return the mean of the shortest interval that holds half of each row of (K, N), (K,)."""
    ordered = np.sort(rows, axis=1)
    half = ordered.shape[1] // 2
    first, _ = narrowest(ordered, half + 1)
    return np.array(
        [row[i : i + half].sum() / half for row, i in zip(ordered, first.tolist(), strict=True)],
        np.float32,
    )


def vertex(three: Float64) -> float:
    """Offset of the maximum of a parabola through three samples from the middle one."""
    left, middle, right = three
    curve = left - 2 * middle + right
    return float(0.5 * (left - right) / curve) if curve < 0 else 0.0
