"""Slip from the imprint of the object: whether it moves relative to the gel surface.

The object slips where its texture moves differently from the markers [1]_. Each frame is warped
back along the markers, so that the gel surface is at rest. Whatever still moves then slips.

References
----------
.. [1] W. Yuan, R. Li, M. A. Srinivasan and E. H. Adelson, "Measurement of shear and slip with a
   GelSight tactile sensor", ICRA, 2015.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import cv2
import numpy as np

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.slip.surface_view import SurfaceView

_TINY = 1e-12
"""Added to denominators against division by zero."""


class ImprintParameters(NamedTuple):
    """Parameters of slip from the imprint. Only ``slip_share`` is an option of ``core.slip``.

    Attributes
    ----------
    slip_share : float, share of the imprint's energy
        Loss at which the object slips.
        Source: chosen on recorded lifts, between those that held, up to 0.33, and those that
        slipped, from 0.42 (ADR 28). Virtual contacts that stick on half of their area lose up to
        0.466 (``benchmarks/slip_imprint_threshold.py``), but 0.5 misses recorded slips.
    memory_s : float, s
        Time constant with which losses are forgotten, so that a grasp that holds again is not
        reported as slipping.
        Source: chosen by hand (ADR 28); no script derives it.
    step_share : float, share of the imprint's energy
        Losses accumulate in steps of this size, so that noise does not accumulate.
        Source: chosen by hand (ADR 28); no script derives it.
    growth : float, ratio
        An imprint whose energy exceeds the template's by this factor becomes the template.
        Source: chosen by hand; no script derives it.
    damping : float, ratio
        Regularisation of the motion fit, relative to its diagonal.
        Source: chosen by hand; no script derives it.
    """

    slip_share: float = 0.4
    memory_s: float = 1.0
    step_share: float = 0.08
    growth: float = 1.02
    damping: float = 1e-3


IMPRINT = ImprintParameters()
"""The values in use."""


@dataclass(frozen=True)
class ImprintMotion:
    """Motion of the object's imprint relative to the gel surface in about the last second.

    Attributes
    ----------
    lost : float
        Share of the imprint's energy that has left its position on the gel surface. It is 0 while
        the object sticks or is pressed harder, however far the gel is sheared, 1 when the whole
        imprint has left, and more while slip continues.
    strength : float
        RMS of the pattern relative to the light.
    moved_px : (float, float)
        Motion of the imprint relative to the surface: +x right, +y down, in pixels of the image. It
        is a relative measure: steps longer than the finest structure are underestimated.
    turned_rad : float
        Rotation relative to the surface, positive from x towards y.
    radius_px : float
        RMS distance of the imprint from its centroid.
    """

    lost: float
    strength: float
    moved_px: tuple[float, float]
    turned_rad: float
    radius_px: float

    @property
    def degree(self) -> float:
        """Degree of slip, 0 to 1; it is 0.5 at the threshold of slip and never reaches 1."""
        return self.lost / (self.lost + IMPRINT.slip_share)

    @property
    def slips(self) -> bool:
        """Whether the loss reaches the threshold of slip."""
        return self.lost >= IMPRINT.slip_share

    @property
    def kind(self) -> Literal["translation", "rotation"]:
        """Whether translation or rotation moved the imprint further."""
        turned_px = abs(self.turned_rad) * self.radius_px
        return "rotation" if turned_px > np.hypot(*self.moved_px) else "translation"


class ImprintTracker:
    """Track the imprint of one object relative to the gel surface.

    The imprint is compared with a template, the strongest imprint at the same position. When the
    loss exceeds noise, the present imprint becomes the template and the loss accumulates. So the
    result depends neither on the frame rate nor on the speed of the slip, and a contact that
    settles counts only once. The noise is estimated from the two most similar successive frames so
    far, so slip counts fully only after a moment without motion.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        Image in which the markers are at ``reference_px``.
    reference_px : (N, 2)
        Positions of the markers, x and y; at least three.
    diameter_px : float
        Diameter of a marker.

    Raises
    ------
    InputError
        There are fewer than three markers, or the diameter is not positive.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        self._view = SurfaceView(pixels, reference_px, diameter_px)
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self._template: _Imprint | None = None
        self._last: _Imprint | None = None
        self._noise = np.inf
        self._lost = 0.0
        self._moved = np.zeros(3)
        self._time_s = 0.0

    def restart(self) -> ImprintMotion:
        """Forget the loss, since pressing harder also changes the imprint.

        The last imprint becomes the template. At least one frame must have been taken.
        """
        assert self._last is not None
        self._template, self._lost, self._moved = self._last, 0.0, np.zeros(3)
        return self._result(self._last, 0.0, np.zeros(3))

    def update(self, pixels: Array, px: Array, timestamp_s: float) -> ImprintMotion:
        """Take the next frame.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame, of the same shape as the first.
        px : (N, 2)
            Present positions of all markers, including inferred ones.
        timestamp_s : float
            Time of the frame.

        Returns
        -------
        ImprintMotion
        """
        now = _Imprint(*self._view.imprint(pixels, px))
        template, last, self._last = self._template, self._last, now
        if template is None or last is None:
            self._template, self._time_s = now, timestamp_s
            return self._result(now, 0.0, np.zeros(3))
        fading = float(np.exp(-max(timestamp_s - self._time_s, 0.0) / IMPRINT.memory_s))
        self._lost, self._moved = self._lost * fading, self._moved * fading
        self._time_s = timestamp_s
        self._noise = noise = min(self._noise, now.distance(last) / 2)
        was = template.energy_within(now) - noise
        lost = min(max(was - template.product(now), 0.0) / max(was, noise, _TINY), 1.0)
        step = _motion(template, now) if lost > IMPRINT.step_share / 2 else np.zeros(3)
        if lost > IMPRINT.step_share:
            self._lost, self._moved = self._lost + lost, self._moved + step
            lost, step = 0.0, np.zeros(3)
            self._template = now
        elif lost == 0 and now.energy_within(template) > IMPRINT.growth * (was + noise):
            self._template = now
        return self._result(now, lost, step)

    def _result(self, now: _Imprint, lost: float, step: Array) -> ImprintMotion:
        x, y, turned = self._moved + step
        times = self._view.times
        return ImprintMotion(
            self._lost + lost,
            float(np.sqrt(now.energy / max(now.count, 1.0))),
            (float(x * times), float(y * times)),
            float(turned),
            now.radius * times,
        )


class _Imprint:
    """The pattern (h, w, K) that an object imprints on the gel surface, and its mask (h, w)."""

    def __init__(self, pattern: Float32, seen: Float32) -> None:
        self.pattern, self.seen = pattern, seen
        channels = pattern.shape[2]
        self.square = cv2.transform(pattern * pattern, np.ones((1, channels), np.float32))
        moments = cv2.moments(self.square)
        self.energy, total = moments["m00"], max(moments["m00"], _TINY)
        self.count = float(seen.sum()) * channels
        self.centre = moments["m10"] / total, moments["m01"] / total
        self.radius = float(np.sqrt((moments["mu20"] + moments["mu02"]) / total))

    def product(self, other: _Imprint) -> float:
        return float(np.vdot(self.pattern, other.pattern))

    def energy_within(self, other: _Imprint) -> float:
        """Energy within the mask of the other imprint."""
        return float(np.vdot(self.square, other.seen))

    def distance(self, other: _Imprint) -> float:
        within = self.energy_within(other) + other.energy_within(self)
        return within - 2 * self.product(other)


def _motion(before: _Imprint, now: _Imprint) -> Array:
    """Small x, y and rotation about the centroid that explain the change, by least squares."""
    half = (before.pattern + now.pattern) / 2
    across, down = gradient(half, smooth=True)
    x, y = before.centre
    columns = np.arange(half.shape[1], dtype=np.float32)[:, np.newaxis] - x
    rows = np.arange(half.shape[0], dtype=np.float32)[:, np.newaxis, np.newaxis] - y
    slopes = np.stack([-across, -down, across * rows - down * columns]).astype(np.float32)
    slopes *= (before.seen * now.seen)[..., np.newaxis]
    slopes = slopes.reshape(3, -1)
    normal = slopes @ slopes.T
    normal += np.diag(np.diag(normal)) * IMPRINT.damping + np.eye(3) * _TINY
    change = (now.pattern - before.pattern).reshape(-1)
    return np.asarray(np.linalg.solve(normal, slopes @ change), np.float64)
