"""The imprint of an object on the gel surface, and what changes between two of them.

Between two frames, the imprint of an object that sticks does not change in coordinates of the gel
surface. An object that slips moves its imprint, and uncovers the texture of the gel itself, which
does not move: that part of the change is not a rigid motion.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.types import Array, Float32

_TINY = 1e-12
"""Added to denominators against division by zero."""


class FitParameters(NamedTuple):
    """Parameters of the fit of a motion.

    Attributes
    ----------
    damping : float, ratio
        Regularisation of the fit, relative to its diagonal.
        Source: chosen by hand; it biases a motion by a thousandth.
    long_step : float, px of the view
        A longer motion is fitted again, from where the last fit ended.
        Source: half a pixel, up to which a linear fit is exact for patterns of three pixels.
    rounds : int, count
        Most fits of one motion.
        Source: chosen by hand; a fit that has not converged after four does not converge.
    """

    damping: float = 1e-3
    long_step: float = 0.5
    rounds: int = 4


FIT = FitParameters()
"""The values in use."""


INNER = slice(1, -1, 2), slice(1, -1)
"""Rows and columns in which changes are fitted."""


class Imprint:
    """The pattern (h, w, K) that an object imprints on the gel surface, and its mask (h, w).

    Parameters
    ----------
    pattern : (h, w, K) float32
        0 where it is hidden.
    seen : (h, w) float32
        1 where the surface is visible, else 0.

    Attributes
    ----------
    energy : float
        Sum of squares of the pattern.
    count : float
        Number of visible values.
    centre : (float, float)
        x and y of the centroid of the energy, px of the view.
    radius : float
        RMS distance of the energy from the centroid, px of the view.
    """

    def __init__(self, pattern: Float32, seen: Float32) -> None:
        self.pattern, self.seen = pattern, seen
        channels = pattern.shape[2]
        square = cv2.transform(pattern * pattern, np.ones((1, channels), np.float32))
        moments = cv2.moments(square)
        self.energy, total = moments["m00"], max(moments["m00"], _TINY)
        self.count = float(seen.sum()) * channels
        self.centre = moments["m10"] / total, moments["m01"] / total
        self.radius = float(np.sqrt((moments["mu20"] + moments["mu02"]) / total))

    def moved(self, motion: Array) -> Imprint:
        """Return the imprint after a motion: x, y and rotation about its centroid."""
        x, y, turn = motion
        cosine, sine = np.cos(turn), np.sin(turn)
        back = np.array([[cosine, sine], [-sine, cosine]])
        from_px = np.array(self.centre) - back @ (np.array(self.centre) + np.array([x, y]))
        warp = np.column_stack([back, from_px]).astype(np.float32)
        size, how = self.seen.shape[::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        pattern = np.asarray(cv2.warpAffine(self.pattern, warp, size, flags=how), np.float32)
        seen = np.asarray(cv2.warpAffine(self.seen, warp, size, flags=how), np.float32)
        return Imprint(pattern.reshape(self.pattern.shape), seen)


class Step(NamedTuple):
    """The change from one imprint to the next.

    Attributes
    ----------
    motion : (3,)
        x, y in px of the view, and rotation about the centroid in rad.
    changed : float
        Energy of the change.
    unexplained : float
        Energy of the change that neither a rigid motion nor a growing load explains.
    energy : float
        Energy of both imprints, where both are visible.
    values : float
        Number of values that are visible in both.
    covariance : (3, 3)
        Of the motion, for noise of variance 1 in each value of the change.
    """

    motion: Array
    changed: float
    unexplained: float
    energy: float
    values: float
    covariance: Array


def step_between(before: Imprint, now: Imprint) -> Step:
    """Fit a rigid motion and a growth of the pattern to a change, by least squares."""
    step = _linear(before, now)
    motion, best = step.motion, np.zeros(3)
    if np.hypot(motion[0], motion[1]) <= FIT.long_step:
        return step
    least = step.changed / max(step.values, 1.0)
    for _ in range(FIT.rounds - 1):
        more = _linear(before.moved(motion), now)
        left = more.changed / max(more.values, 1.0)
        if left >= least:  # a motion along stripes, for example, cannot be seen
            break
        best, least, motion = motion, left, motion + more.motion
        if np.hypot(more.motion[0], more.motion[1]) <= FIT.long_step:
            return step._replace(motion=motion)
    return step._replace(motion=best)


def _linear(before: Imprint, now: Imprint) -> Step:
    """Fit the change of every second row; the others say nearly the same, after smoothing."""
    channels = now.pattern.shape[2]
    # next to a hidden pixel, the gradient is that of the mask
    both = np.asarray(cv2.erode(before.seen * now.seen, np.ones((3, 3), np.uint8)), np.float32)
    weight = np.repeat(both[INNER][..., np.newaxis], channels, axis=2)
    total = before.pattern + now.pattern
    # central differences of the mean of both
    across = (total[1:-1:2, 2:] - total[1:-1:2, :-2]) * np.float32(0.25)
    down = (total[2::2, 1:-1] - total[:-2:2, 1:-1]) * np.float32(0.25)
    x, y = before.centre
    columns = np.arange(1, total.shape[1] - 1, dtype=np.float32)[:, np.newaxis] - np.float32(x)
    rows = np.arange(1, total.shape[0] - 1, 2, dtype=np.float32)[:, np.newaxis, np.newaxis]
    away: Array = np.empty((3, *weight.shape), np.float32)
    np.multiply(across, -weight, out=away[0])
    np.multiply(down, -weight, out=away[1])
    np.subtract(away[1] * columns, away[0] * (rows - np.float32(y)), out=away[2])
    slopes = away.reshape(3, -1)
    half = total[INNER] * (np.float32(0.5) * weight)
    change = ((now.pattern[INNER] - before.pattern[INNER]) * weight).reshape(-1)
    normal = (slopes @ slopes.T).astype(np.float64)
    normal += np.diag(np.diag(normal)) * FIT.damping + np.eye(3) * _TINY
    covariance = np.linalg.inv(normal)
    slope = (slopes @ change).astype(np.float64)
    motion = covariance @ slope
    changed, middle = float(change @ change), float(np.vdot(half, half))
    # a growing load strengthens the pattern in place; a weaker pattern may be one that leaves
    growth = max(float(half.reshape(-1) @ change), 0.0)
    explained = float(slope @ motion) + growth**2 / max(middle, _TINY)
    return Step(
        motion,
        changed,
        max(changed - explained, 0.0),
        2 * middle + changed / 2,
        float(weight.sum()),
        covariance,
    )
