"""Regressions on few and on many features, weighted by how far each extrapolates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64, Intp

PENALTIES = (1e-4, 1e-3, 1e-2, 1e-1)
FOLDS = 10


class Regression(NamedTuple):
    """One ridge regression through the origin.

    Attributes
    ----------
    scale : (K,) float64
        Root mean square of the features, by group.
    weights : (K, 3) float64
    inverse : (K, K) float64
        Of the penalised normal equations.
    variance : (3,) float64
        Mean square error on held-out segments.
    freedom : float
        Effective number of weights.
    count : int
        Number of samples.
    """

    scale: Float64
    weights: Float64
    inverse: Float64
    variance: Float64
    freedom: float
    count: int

    def predict(self, features: Float64) -> tuple[Float64, Float64]:
        """Return (N, 3) forces and their variances, which grow with the leverage of a frame."""
        scaled = features / self.scale
        leverage = np.einsum("ij,jk,ik->i", scaled, self.inverse, scaled)
        growth = 1 + leverage * self.count / self.freedom
        return scaled @ self.weights, self.variance * growth[:, None]


def fitted(features: Float64, scale: Float64, forces: Float64, segments: Intp) -> Regression:
    """Fit a regression whose penalty has the least error on held-out segments."""
    scaled, fold = features / scale, segments % FOLDS
    tried = []
    for penalty in PENALTIES:
        missed = np.zeros_like(forces)
        for out in range(FOLDS):
            kept = fold != out
            found = _inverse(scaled[kept], penalty) @ scaled[kept].T @ forces[kept]
            missed[~kept] = scaled[~kept] @ found - forces[~kept]
        tried.append((missed**2).mean(0))
    best = int(np.argmin([(one / forces.var(0)).sum() for one in tried]))
    inverse = _inverse(scaled, PENALTIES[best])
    freedom = max(1.0, float(np.trace(inverse @ scaled.T @ scaled)))
    weights = inverse @ scaled.T @ forces
    return Regression(scale, weights, inverse, tried[best], freedom, len(forces))


def combined(found: Sequence[tuple[Float64, Float64]]) -> tuple[Float64, Float64]:
    """Return the mean of predictions, weighted by their inverse variances, and its variance.

    The errors of the regressions are similar, not independent, so that the variance is their
    weighted mean and not smaller.
    """
    forces = np.stack([one for one, _ in found])
    variances = np.stack([one for _, one in found])
    weights = 1 / variances / (1 / variances).sum(0)
    return (weights * forces).sum(0), (weights * variances).sum(0)


def _inverse(scaled: Float64, penalty: float) -> Float64:
    count = scaled.shape[1]
    normal = scaled.T @ scaled + penalty * len(scaled) * np.eye(count)
    return np.asarray(np.linalg.inv(normal))
