"""The imprint of an object on the gel surface, and what changes between two of them.

Between two frames, the imprint of an object that sticks does not change in coordinates of the gel
surface. An object that slips moves its imprint, and uncovers marks of the gel surface itself, which
do not move: that part of the change is not a rigid motion.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.gradient import gradient
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
    motion = step.motion
    if np.hypot(motion[0], motion[1]) <= FIT.long_step:
        return step
    for _ in range(FIT.rounds - 1):
        more = _linear(before.moved(motion), now).motion
        motion = motion + more
        if np.hypot(more[0], more[1]) <= FIT.long_step:
            break
    return step._replace(motion=motion)


def _linear(before: Imprint, now: Imprint) -> Step:
    # next to a hidden pixel, the gradient is that of the mask
    both = np.asarray(cv2.erode(before.seen * now.seen, np.ones((3, 3), np.uint8)), np.float32)
    count = float(both.sum()) * now.pattern.shape[2]
    half: Array = (before.pattern + now.pattern) * np.float32(0.5)
    across, down = gradient(half, smooth=True)
    x, y = before.centre
    columns = np.arange(half.shape[1], dtype=np.float32)[:, np.newaxis] - np.float32(x)
    rows = np.arange(half.shape[0], dtype=np.float32)[:, np.newaxis, np.newaxis] - np.float32(y)
    weight = np.repeat(both[..., np.newaxis], half.shape[2], axis=2)
    away: Array = np.empty((3, *half.shape), np.float32)
    np.multiply(across, -weight, out=away[0])
    np.multiply(down, -weight, out=away[1])
    np.subtract(away[1] * columns, away[0] * rows, out=away[2])
    slopes = away.reshape(3, -1)
    change = ((now.pattern - before.pattern) * weight).reshape(-1)
    half = half * weight
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
        count,
        covariance,
    )
