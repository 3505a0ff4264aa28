"""Ridge regression through the origin, its penalty chosen by sequences that it has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64, Intp


class FORCE_RIDGE:
    """Parameters of the regression. Nothing sets them from outside."""

    # [share of a feature's mean square] Penalties that are tried; the one with the least error on
    # held-out sequences is used. Source: definition: from none that matters to one that removes
    # all but the strongest features, in steps finer than the minimum is sharp.
    penalties: tuple[float, ...] = (1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)


class RidgeFit(NamedTuple):
    """Weights of the features, and what they predict of sequences that they were not fitted on.

    Attributes
    ----------
    weights : (K,) float64
    penalty : float
    held_out : (N,) float64
        Prediction of each sample by weights fitted without its sequence.
    """

    weights: Float64
    penalty: float
    held_out: Float64


def fitted_ridge(
    features: Float64, force: Float64, sequences: Intp, *, rising: bool = False
) -> RidgeFit:
    """Fit ``force = features · weights`` by ridge regression [1]_ without an intercept.

    Features are divided by their root mean square. At rest they are zero, and then so is the force.

    Parameters
    ----------
    features : (N, K) float64
    force : (N,) float64
        N or N·mm.
    sequences : (N,) int
        Sequence of each sample. With a single one the smallest penalty is used.
    rising : bool
        No weight may be negative, so that the force increases with every feature.

    References
    ----------
    .. [1] A. E. Hoerl and R. W. Kennard, "Ridge regression: biased estimation for nonorthogonal
       problems", Technometrics 12(1), 1970.
    """
    each = np.unique(sequences)
    tried = FORCE_RIDGE.penalties if len(each) > 1 else FORCE_RIDGE.penalties[:1]
    held_out = np.zeros((len(tried), len(force)))
    if len(each) > 1:
        for one in each:
            out = sequences == one
            weights = _all_weights(features[~out], force[~out], tried, rising)
            held_out[:, out] = weights @ features[out].T
    best = int(((held_out - force) ** 2).sum(1).argmin()) if len(each) > 1 else 0
    weights = _all_weights(features, force, tried[best : best + 1], rising)[0]
    found = held_out[best] if len(each) > 1 else features @ weights
    return RidgeFit(weights, tried[best], found)


def _all_weights(
    features: Float64, force: Float64, penalties: Sequence[float], rising: bool
) -> Float64:
    """(P, K) weights of each penalty."""
    scale = np.sqrt((features**2).mean(0))
    scale[scale == 0] = 1
    scaled = features / scale
    if rising:
        found = np.stack([_rising(scaled, force, penalty) for penalty in penalties])
        return np.asarray(found / scale)
    values, vectors = np.linalg.eigh(scaled.T @ scaled / len(scaled))
    along = vectors.T @ (scaled.T @ force / len(scaled))
    damped = along / (np.maximum(values, 0) + np.array(penalties)[:, None])
    return np.asarray(damped @ vectors.T / scale)


def _rising(scaled: Float64, force: Float64, penalty: float) -> Float64:
    from scipy.optimize import nnls

    count = scaled.shape[1]
    rows = np.concatenate([scaled, np.sqrt(penalty * len(scaled)) * np.eye(count)])
    weights, _ = nnls(rows, np.concatenate([force, np.zeros(count)]))
    return np.asarray(weights)
