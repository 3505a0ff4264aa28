"""The offset of two clocks, and ridge regression."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64, Intp

_OVERLAP = 0.5  # [share] Share of the frames that must still have a force: half of the recording


class ClockOffset(NamedTuple):
    """The offset with the best correlation.

    Attributes
    ----------
    offset_s : float
        Time of the load cell minus that of the camera, at the same moment.
    explained : float
        Share of the force's variance that the features explain there.
    """

    offset_s: float
    explained: float

    @property
    def found(self) -> bool:
        """Whether the two belong together."""
        return self.explained >= 0.5  # [share] less: other recordings


def clock_offset(
    frames_s: Float64, features: Float64, times_s: Float64, force: Float64
) -> ClockOffset:
    """Find the offset at which the features explain the force best.

    Parameters
    ----------
    frames_s : (N,) float64
        Time of each frame, increasing.
    features : (N, K) float64
    times_s : (M,) float64
        Time of each force, increasing.
    force : (M,) float64
        The component with the most information.
    """
    aligned_s = float(times_s[0] - frames_s[0])
    spans_s = float(np.ptp(frames_s)), float(np.ptp(times_s))
    reach_s = (1 - _OVERLAP) * spans_s[0]
    first_s, last_s = -reach_s, max(spans_s[1] - spans_s[0], 0.0) + reach_s
    frame_s = spans_s[0] / max(len(frames_s) - 1, 1)
    # [per frame] A parabola refines them; 2000 take a second
    count = int(min((last_s - first_s) * 2.0 / frame_s + 1, 2000))
    tried_s = aligned_s + np.linspace(first_s, last_s, max(count, 3))
    shares = np.array([_explained_share(frames_s + s, features, times_s, force) for s in tried_s])
    best = int(shares.argmax())
    offset_s = float(tried_s[best])
    if 0 < best < len(shares) - 1:
        before, here, after = shares[best - 1 : best + 2]
        bend = before - 2 * here + after
        if np.isfinite(bend) and bend < 0:
            offset_s += float(0.5 * (before - after) / bend * (tried_s[1] - tried_s[0]))
    return ClockOffset(offset_s, float(shares[best]))


def _explained_share(at_s: Float64, features: Float64, times_s: Float64, force: Float64) -> float:
    inside = (at_s >= times_s[0]) & (at_s <= times_s[-1])
    if inside.sum() < max(_OVERLAP * len(at_s), 3):
        return -np.inf
    wanted = np.interp(at_s[inside], times_s, force)
    given = features[inside] - features[inside].mean(0)
    wanted = wanted - wanted.mean()
    total = float(wanted @ wanted)
    if total == 0:
        return -np.inf
    scale = np.sqrt((given**2).mean(0))
    given = given / np.where(scale > 0, scale, 1)
    # [share] Features that are multiples of others do no harm
    normal = given.T @ given + 1e-4 * len(given) * np.eye(given.shape[1])
    rest = wanted - given @ np.linalg.solve(normal, given.T @ wanted)
    return 1 - float(rest @ rest) / total


# [share of a feature's mean square] Penalties that are tried; the one with the least error on held-
# out sequences is used: definition: from none that matters to one that removes all but the
# strongest features, in steps finer than the minimum is sharp
_PENALTIES: tuple[float, ...] = (1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)


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
    tried = _PENALTIES if len(each) > 1 else _PENALTIES[:1]
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
