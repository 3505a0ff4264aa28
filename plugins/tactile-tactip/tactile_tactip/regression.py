"""Numbers from the displacement of pins: a Gaussian process that knows its errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.errors import CalibrationError

FEWEST = 50  # [count] Fewest presses: 60 of the recorded ones give angles half as well as 400
_MOST = 800  # [count] More presses are thinned out evenly: time grows with their cube
_PATTERNS = (4, 6, 8, 12, 16, 24, 32)  # [count] Patterns of displacement that are tried
_NOISE_PX = 0.05  # [px] Error of a pin's position: a weaker pattern is not amplified to full size
_LENGTHS = 0.125 * 2.0 ** np.arange(7)  # [spread of the presses] that are tried
_NOISES = 10.0 ** np.arange(-5, 1.1, 0.25)  # [variance of the process] that are tried
_NEIGHBOURS = 1 / 8  # [share of the presses] whose errors give their size at one level


@dataclass(frozen=True, eq=False)
class PinRegression:
    """A Gaussian process over the main patterns of displacement, one for each number.

    Attributes
    ----------
    mean : (P,) float64
        Mean displacement of the fitted presses: x and y of each pin, px.
    patterns : (P, K) float64
        Principal patterns, each scaled so that the presses spread by 1, 1 / px.
    places : (N, K) float64
        The fitted presses in these patterns.
    values : (N, M) float64
        Their numbers, scaled.
    count, length, amplitude, noise : (M,) float64
        Of each process: number of patterns, correlation length, variance, and variance of the
        noise over that.
    levels : (N,) float64
        Increasing values of the first number, scaled.
    excess : (N, M) float64
        Variance of the errors at these levels over that which the process expects.
    centre, scale : (M,) float64
        Mean and standard deviation of the numbers.
    """

    mean: Float64
    patterns: Float64
    places: Float64
    values: Float64
    count: Float64
    length: Float64
    amplitude: Float64
    noise: Float64
    levels: Float64
    excess: Float64
    centre: Float64
    scale: Float64

    def __post_init__(self) -> None:
        (pins, patterns), (count, numbers) = self.patterns.shape, self.values.shape
        shapes = {
            "mean": (pins,),
            "places": (count, patterns),
            "levels": (count,),
            "excess": (count, numbers),
            **dict.fromkeys(("count", "length", "amplitude", "noise"), (numbers,)),
            **dict.fromkeys(("centre", "scale"), (numbers,)),
        }
        wrong = [name for name, shape in shapes.items() if getattr(self, name).shape != shape]
        if wrong:
            raise ValueError(f"the shape of {', '.join(wrong)} does not match")
        if not all(np.isfinite(array).all() for array in self.arrays().values()):
            raise ValueError("not all numbers are finite")
        positive = self.count, self.length, self.amplitude, self.noise
        if not all((one > 0).all() for one in positive):
            raise ValueError("a length or variance is not positive")

    def predict(self, moved_px: Float64) -> tuple[Float64, Float64]:
        """Return the numbers (L, M) of displacements (L, P), and their standard deviations."""
        at = (moved_px - self.mean) @ self.patterns
        found, variance = np.empty((2, len(at), len(self.scale)))
        for m, inverse in enumerate(self._inverses):
            here, there = (_reduced(one, self.count[m]) for one in (at, self.places))
            near = _kernel(here, there, self.length[m])
            found[:, m] = near @ (inverse @ self.values[:, m])
            itself = np.square(here).sum(axis=1) + 1 + self.noise[m]
            known = np.einsum("ln,nk,lk->l", near, inverse, near)
            variance[:, m] = self.amplitude[m] * np.maximum(itself - known, self.noise[m])
        variance *= _at_levels(found[:, 0], self.levels, self.excess)
        return found * self.scale + self.centre, np.sqrt(variance) * self.scale

    @property
    def extremes(self) -> tuple[Float64, Float64]:
        """Smallest and largest of the fitted numbers, (M,) each."""
        low, high = self.values.min(axis=0), self.values.max(axis=0)
        return low * self.scale + self.centre, high * self.scale + self.centre

    @cached_property
    def _inverses(self) -> list[Float64]:
        """(N, N) for each number: the inverse of the covariance over the amplitude."""
        inverses = []
        for count, length, noise in zip(self.count, self.length, self.noise, strict=True):
            places = _reduced(self.places, count)
            own = noise * np.eye(len(places))
            inverses.append(np.linalg.inv(_kernel(places, places, length) + own))
        return inverses

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the arrays for :meth:`from_arrays`, by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """Rebuild a regression from its arrays.

        Raises
        ------
        KeyError, ValueError
            An array is missing, or does not match the others.
        """
        return cls(**{one.name: np.asarray(arrays[one.name], np.float64) for one in fields(cls)})


def fit_regression(moved_px: Float64, numbers: Float64) -> PinRegression:
    """Fit the numbers of presses to the displacement of the pins.

    The displacements are reduced to their principal components, and each number is a Gaussian
    process in the first of these: a plane, which extrapolates, and deviations from it over a
    correlation length. Their number, the length, the amplitude and the noise maximise the evidence
    ([1]_, section 5.4.1): few are enough for small motions, and a contact that wanders over the
    dome needs many.

    The errors differ between presses: a surface that hardly touches moves no pin and leaves its
    distance open. So the variance is scaled by the squared errors of left-out presses, over those
    that the process expects ([1]_, section 5.4.2), in the mean over the presses whose first number
    is predicted most alike.

    Parameters
    ----------
    moved_px : (N, P) float64
        Displacement of the pins in each press.
    numbers : (N, M) float64
        What was measured.

    Raises
    ------
    CalibrationError
        There are too few presses, the pins do not move, or a number is the same in all presses.

    References
    ----------
    .. [1] C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning", MIT
       Press, 2006.
    """
    if len(moved_px) > _MOST:
        kept = np.linspace(0, len(moved_px) - 1, _MOST).round().astype(np.intp)
        moved_px, numbers = moved_px[kept], numbers[kept]
    centre, scale = numbers.mean(axis=0), numbers.std(axis=0)
    labels_differ = bool((scale > 1e-9 * (1 + np.abs(centre))).all())  # beyond rounding
    mean, patterns = _principal_patterns(moved_px)
    _refuse_undetermined(len(moved_px), pins_move=patterns.size > 0, labels_differ=labels_differ)
    places, values = (moved_px - mean) @ patterns, (numbers - centre) / scale
    best = _most_evident(places, values)
    expected = np.stack([np.diag(one.inverse) for one in best], axis=1)
    weights = np.stack([one.inverse @ values[:, m] for m, one in enumerate(best)], axis=1)
    amplitude = np.array([one.amplitude for one in best])
    left_out = weights / expected  # the error at a press that the process was not given
    levels, excess = _local_means(values[:, 0] - left_out[:, 0], left_out**2 * expected / amplitude)
    return PinRegression(
        mean=mean,
        patterns=patterns,
        places=places,
        values=values,
        count=np.array([one.patterns for one in best], np.float64),
        length=np.array([one.length for one in best]),
        amplitude=amplitude,
        noise=np.array([one.noise for one in best]),
        levels=levels,
        excess=excess,
        centre=centre,
        scale=scale,
    )


def _principal_patterns(moved_px: Float64) -> tuple[Float64, Float64]:
    """Mean displacement (P,), and the largest patterns about it (P, K) over their size.

    K is 0 where the pins do not move.
    """
    mean = moved_px.mean(axis=0)
    _, size, across = np.linalg.svd(moved_px - mean, full_matrices=False)
    size = size[: max(_PATTERNS)] / np.sqrt(len(moved_px))
    if size[0] < _NOISE_PX:
        size = size[:0]
    return mean, across[: len(size)].T / np.hypot(size, _NOISE_PX)


def _refuse_undetermined(count: int, *, pins_move: bool, labels_differ: bool) -> None:
    what = ""
    if count < FEWEST:
        what = (
            f"{count} are too few; label at least {FEWEST}, better 400, at all distances and "
            f"angles that are to be measured"
        )
    elif not pins_move:
        what = "the pins do not move; check that the recording shows presses"
    elif not labels_differ:
        what = "a label is the same in all of them; check the columns of the labels"
    if what:
        raise CalibrationError(f"the presses do not determine distance and angle: {what}")


class _Process(NamedTuple):
    """The parameters of one number, and the inverse (N, N) of its covariance over the amplitude."""

    evidence: float
    patterns: int
    length: float
    noise: float
    amplitude: float
    inverse: Float64


def _most_evident(places: Float64, values: Float64) -> list[_Process]:
    """The process of each number with the largest evidence among those that are tried."""
    best: list[_Process | None] = [None] * values.shape[1]
    for count, length in product(_PATTERNS, _LENGTHS):
        reduced = _reduced(places, count)
        size, vectors = np.linalg.eigh(_kernel(reduced, reduced, length))
        along = vectors.T @ values
        for noise in _NOISES:
            variance = np.maximum(size, 0) + noise
            for m, before in enumerate(best):
                amplitude = float((along[:, m] ** 2 / variance).mean())  # the most evident one
                evidence = -float(np.log(variance).sum() + len(values) * np.log(amplitude)) / 2
                if before is None or evidence > before.evidence:
                    inverse = (vectors / variance) @ vectors.T
                    best[m] = _Process(evidence, count, length, noise, amplitude, inverse)
    return [one for one in best if one is not None]


def _reduced(places: Float64, count: float) -> Float64:
    """The first patterns alone, scaled so that the presses spread by 1 in all of them together."""
    return np.asarray(places[:, : int(count)] / np.sqrt(count))


def _kernel(one: Float64, other: Float64, length: float) -> Float64:
    """(L, N): covariance of a plane and of deviations from it, each with the same amplitude."""
    plane = one @ other.T
    apart = np.square(one).sum(axis=1)[:, None] + np.square(other).sum(axis=1) - 2 * plane
    return np.asarray(plane + np.exp(-np.maximum(apart, 0) / (2 * length**2)))


def _local_means(level: Float64, squares: Float64) -> tuple[Float64, Float64]:
    """Sorted levels, and the mean (N, M) over the presses nearest in order; never quite 0."""
    count = len(level)
    order = np.argsort(level, kind="stable")
    reach = max(1, round(count * _NEIGHBOURS / 2))
    sums = np.concatenate([np.zeros((1, squares.shape[1])), np.cumsum(squares[order], axis=0)])
    low = np.maximum(np.arange(count) - reach, 0)
    high = np.minimum(np.arange(count) + reach + 1, count)
    means = (sums[high] - sums[low]) / (high - low)[:, None]
    return level[order], np.maximum(means, 1e-6)


def _at_levels(level: Float64, levels: Float64, excess: Float64) -> Float64:
    return np.stack([np.interp(level, levels, one) for one in excess.T], axis=1)
