"""Follows an imprint, and the noise of one that rests."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import inf
from operator import mul
from statistics import median
from typing import Literal, NamedTuple

import numpy as np

from tactile_core.algorithms.arrays.regression import quantile
from tactile_core.algorithms.arrays.types import TINY, Array, UInt8
from tactile_core.algorithms.markers.contrast import Tone
from tactile_core.algorithms.slip.imprint import (
    VIEW,
    Imprint,
    ImprintStep,
    Motion,
    SurfaceView,
    step_between,
)


class NOISE:
    """Parameters of the noise."""

    # [mm] RMS motion of the markers below which the surface is still. Source: twice the noise of
    # a marker's motion between two frames, a tenth of a pixel each.
    still_mm = 0.005
    # [count] Still frames in which the noise is judged. Source: a second at 30 Hz; later ones may
    # already show an object that slides steadily.
    first = 30


class StillNoise:
    """Variance of the change of one value between frames.

    Attributes
    ----------
    variance : float
        That of the two most similar successive frames so far; infinite before the second frame.
    steady : bool
        Whether it varies little while the surface is still.
    """

    def __init__(self) -> None:
        self.variance = inf
        self.steady = True
        self._still: list[float] = []

    def update(self, change: float, moved_mm: float) -> None:
        """Take the mean squared change of a value, and the RMS motion of the markers."""
        if change == 0:  # a frame that a camera or video repeats has no noise of its own
            return
        self.variance = min(self.variance, change)
        if moved_mm < NOISE.still_mm and len(self._still) < NOISE.first:
            self._still.append(change)
            if len(self._still) >= 4:  # [frames] before a lift there are about five
                # [ratio] A camera's noise varies by a tenth (recorded lifts), a compressed video's
                # by 4 to 75 (recorded grasps), because each key frame draws the picture anew
                self.steady = median(self._still) <= 2.0 * min(self._still)


# [s] Time constant with which changes are forgotten, so that a grasp that holds again is not
# reported as slipping (ADR 43)
_MEMORY_S = 1.0
# [share of the energy per mm] Change of an imprint that sticks, per RMS motion of the markers: the
# warp between markers is not exact, and the light changes as the surface moves through it: recorded
# lifts, each object by the others (``benchmarks/slip_lift_folds.py``)
_CHANGE_PER_MM = 0.6
# [ratio] Largest distance that the object moves over a surface that still sticks, relative to the
# motion of the surface: at the onset of gross slip the traction is that of Cattaneo and Mindlin,
# under which the mean displacement of a layer that is thin relative to the contact is two thirds of
# the object's; the mean slip is half of that displacement. It is less on a thick layer
_ELASTIC_SHARE = 0.5
# [standard deviations] Uncertainty of a distance that does not count as slip: two standard
# deviations, 2 % of false alarms from noise alone
_SIGMAS = 2.0
# [px of the view] Distance that does not count as slip either, since interpolated patterns drift: a
# fifth of a pixel
_DRIFT = 0.2


@dataclass(frozen=True)
class ImprintChange:
    """Change and motion of the object's imprint relative to the gel surface.

    Attributes
    ----------
    changed : float
        Share of the imprint's energy that changed in about the last second although neither a rigid
        motion nor the shear of the surface explains it. 0 while the object sticks or is pressed
        harder; 1 when a whole imprint has left, and more while slip continues.
    moved : float
        Distance of the last second, relative to the largest that elastic deformation and
        uncertainty explain; above 1 the object has slid.
    distance_mm, distance_std_mm : float
        RMS motion of the imprint relative to the surface since it is tracked, and its standard
        deviation.
    turned_rad : float
        Rotation of the last second relative to the surface, positive from x towards y.
    strength : float
        RMS of the pattern relative to the light.
    kind : str
        Whether translation or rotation moved the imprint further in the last second.
    """

    changed: float
    moved: float
    distance_mm: float
    distance_std_mm: float
    turned_rad: float
    strength: float
    kind: Literal["translation", "rotation"]


class ImprintTracker:
    """Track the imprint of one object relative to the gel surface, from frame to frame.

    The noise is that of the two most similar successive frames so far, so slip counts fully only
    after a moment without motion. Where the noise is not steady, as in compressed video, only the
    distance counts.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        Image in which the markers are at ``reference_px``.
    reference_px : (N, 2)
        Positions of the markers, x and y; at least three.
    diameter_px : float
        Diameter of a marker.
    mm_per_px : float
    tone : {"dark", "bright"}
        Whether markers are darker or brighter than the gel.
    change_per_mm : float
        Change of an imprint that sticks, per mm that it moved.

    Raises
    ------
    InputError
        There are fewer than three markers, or the diameter is not positive.
    """

    def __init__(
        self,
        pixels: Array,
        reference_px: Array,
        diameter_px: float,
        mm_per_px: float,
        *,
        tone: Tone = "dark",
        change_per_mm: float = _CHANGE_PER_MM,
    ) -> None:
        self._change_per_mm = change_per_mm
        self._view = SurfaceView(pixels, reference_px, diameter_px, tone)
        self._mm_per_px = mm_per_px
        self.reset()

    @property
    def takes_halves(self) -> bool:
        """Whether the means of a frame over 2 × 2 pixels make an update faster."""
        return self._view.takes_halves

    def reset(self) -> None:
        """Forget the object."""
        self._last: Imprint | None = None
        self._px: Array | None = None
        self._noise = StillNoise()
        self._time_s = 0.0
        self.restart()

    def restart(self) -> ImprintChange:
        """Forget all changes, since pressing harder also changes the imprint."""
        self._changed = self._sheared_mm = 0.0
        self._way, self._recent = _Way(), _Way()
        return self._result()

    def update(
        self, pixels: Array, px: Array, timestamp_s: float, halves: UInt8 | None = None
    ) -> ImprintChange:
        """Take the next frame.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame, of the same shape as the first.
        px : (N, 2)
            Present positions of all markers, including inferred ones.
        timestamp_s : float
            Time of the frame.
        halves : (H / 2, W / 2, 3) uint8, optional
            The means over 2 × 2 pixels of a frame of bytes, if they are known.

        Returns
        -------
        ImprintChange
        """
        now = Imprint(*self._view.imprint(pixels, px, halves))
        last, before_px, elapsed_s = self._last, self._px, timestamp_s - self._time_s
        self._last, self._px, self._time_s = now, px, timestamp_s
        if last is None or before_px is None:
            return self._result()
        step = step_between(last, now)
        moved_mm = np.hypot(*(px - before_px).T) * self._mm_per_px
        share = self._unexplained_share(step, math.sqrt(moved_mm @ moved_mm / len(moved_mm)))
        kept = math.exp(-max(elapsed_s, 0.0) / _MEMORY_S)
        self._changed = self._changed * kept + share if self._noise.steady else 0.0
        # [share of the markers] A contact that covers a tenth is enough
        self._sheared_mm = self._sheared_mm * kept + quantile(moved_mm, 0.9)
        way = self._metric(step, now.radius)
        self._way, self._recent = self._way.plus(way), self._recent.scale_way(*[kept] * 3).plus(way)
        return self._result()

    def _unexplained_share(self, step: ImprintStep, moved_mm: float) -> float:
        """Share of the energy whose change nothing but slip explains."""
        values = max(step.values, 1.0)
        self._noise.update(step.changed / values, moved_mm)
        if not self._noise.steady or math.isinf(self._noise.variance):
            return 0.0
        noise = self._noise.variance * values
        explained = noise + self._change_per_mm * moved_mm * step.energy
        return max(step.unexplained - explained, 0.0) / max(step.energy, noise, TINY)

    def _metric(self, step: ImprintStep, radius: float) -> _Way:
        """Motion of the imprint in mm, with rotation as RMS motion, and its variances in mm²."""
        scale = self._view.times * self._mm_per_px
        variance = self._noise.variance if math.isfinite(self._noise.variance) else 0.0
        # what changed without a motion may have moved by the length over which patterns differ
        left = max(step.unexplained - variance * step.values, 0.0)
        # neighbouring values share the noise that the box filter spread over them
        noise = variance * VIEW.smoothing_px**2 + left
        x, y, turn = (noise * of_motion for of_motion in step.variance)
        return _Way(step.motion, (x, y, turn)).scale_way(scale, scale, scale * radius)

    def _result(self) -> ImprintChange:
        recent, last = self._recent, self._last
        scale = self._view.times * self._mm_per_px
        explained = _ELASTIC_SHARE * self._sheared_mm + _SIGMAS * recent.std_mm
        turned = abs(recent.mm[2]) > math.hypot(recent.mm[0], recent.mm[1])
        radius_mm = 0.0 if last is None else last.radius * scale
        return ImprintChange(
            self._changed,
            recent.length_mm / (explained + _DRIFT * scale),
            self._way.length_mm,
            self._way.std_mm,
            recent.mm[2] / max(radius_mm, TINY),
            0.0 if last is None else math.sqrt(last.energy / max(last.count, 1.0)),
            "rotation" if turned else "translation",
        )


class _Way(NamedTuple):
    """A sum of motions in mm: x, y and rotation; and its variances."""

    mm: Motion = (0.0, 0.0, 0.0)
    variance: Motion = (0.0, 0.0, 0.0)

    @property
    def length_mm(self) -> float:
        return math.hypot(*self.mm)

    @property
    def std_mm(self) -> float:
        """Standard deviation along the motion; that of all directions if there is none."""
        squares = [side * side for side in self.mm]
        total = sum(squares)
        if total == 0:
            return math.sqrt(sum(self.variance))
        return math.sqrt(sum(map(mul, squares, self.variance)) / total)

    def plus(self, other: _Way) -> _Way:
        (x, y, t), (var_x, var_y, var_t) = self
        mm, variance = other
        return _Way(
            (x + mm[0], y + mm[1], t + mm[2]),
            (var_x + variance[0], var_y + variance[1], var_t + variance[2]),
        )

    def scale_way(self, x: float, y: float, t: float) -> _Way:
        mm, variance = self
        return _Way(
            (mm[0] * x, mm[1] * y, mm[2] * t),
            (variance[0] * x * x, variance[1] * y * y, variance[2] * t * t),
        )
