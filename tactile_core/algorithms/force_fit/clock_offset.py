"""Time offset between a load cell and a camera, by correlation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.types import Float64


class CLOCK_OFFSET:
    """Parameters of the search. Nothing sets them from outside."""

    # [share] Share of the frames that must still have a force. Source: by hand, : half of the
    # recording.
    overlap = 0.5
    # [count per frame] Offsets that are tried between two frames. Source: by hand, a parabola
    # refines them.
    steps = 2.0
    # [share] Least share of the force that the features explain at the best offset. Source: by
    # hand, : below it the two belong to different recordings.
    least = 0.5
    most = 2000  # [count] Most offsets that are tried. Source: by hand, : a second on one core.
    # [share] Penalty of the regression. Source: by hand, : features that are multiples of others
    # do no harm.
    ridge = 1e-4


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
        return self.explained >= CLOCK_OFFSET.least


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
    reach_s = (1 - CLOCK_OFFSET.overlap) * spans_s[0]
    first_s, last_s = -reach_s, max(spans_s[1] - spans_s[0], 0.0) + reach_s
    frame_s = spans_s[0] / max(len(frames_s) - 1, 1)
    count = int(min((last_s - first_s) * CLOCK_OFFSET.steps / frame_s + 1, CLOCK_OFFSET.most))
    tried_s = aligned_s + np.linspace(first_s, last_s, max(count, 3))
    shares = np.array([_explained(frames_s + s, features, times_s, force) for s in tried_s])
    best = int(shares.argmax())
    offset_s = float(tried_s[best])
    if 0 < best < len(shares) - 1:
        before, here, after = shares[best - 1 : best + 2]
        bend = before - 2 * here + after
        if np.isfinite(bend) and bend < 0:
            offset_s += float(0.5 * (before - after) / bend * (tried_s[1] - tried_s[0]))
    return ClockOffset(offset_s, float(shares[best]))


def _explained(at_s: Float64, features: Float64, times_s: Float64, force: Float64) -> float:
    inside = (at_s >= times_s[0]) & (at_s <= times_s[-1])
    if inside.sum() < max(CLOCK_OFFSET.overlap * len(at_s), 3):
        return -np.inf
    wanted = np.interp(at_s[inside], times_s, force)
    given = features[inside] - features[inside].mean(0)
    wanted = wanted - wanted.mean()
    total = float(wanted @ wanted)
    if total == 0:
        return -np.inf
    scale = np.sqrt((given**2).mean(0))
    given = given / np.where(scale > 0, scale, 1)
    normal = given.T @ given + CLOCK_OFFSET.ridge * len(given) * np.eye(given.shape[1])
    rest = wanted - given @ np.linalg.solve(normal, given.T @ wanted)
    return 1 - float(rest @ rest) / total
