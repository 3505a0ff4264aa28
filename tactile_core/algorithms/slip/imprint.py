"""Whether the imprint of the object stays where it was printed on the skin.

The 2015 paper compares the motion of the markers with that of the object's own texture: where they
part, the object slips [Yuan 2015]. Here both are told from one image. It is drawn back along the
markers, so that the skin stands still, and what then still moves has left its place on the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from tactile_core.algorithms.arrays.gradient import gradient
from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.slip.surface_view import SurfaceView

SLIP_SHARE = 0.4
"""Slip is where this much of the imprint has left its place within about a second.

Chosen on recorded lifts, between those that held and those that slipped. Virtual contacts of which
half or more sticks lose up to 0.466 (``benchmarks/slip_imprint_threshold.py``); at 0.5 slips are
missed. Margin and control: ``docs/reference/accuracy.md``.
"""

_MEMORY_S = 1.0
"""What was lost is forgotten: a grasp that held again is no longer slipping."""

_STEP_SHARE = 0.08
"""Losses are added up in steps of this size, so that noise, which comes and goes, is not."""

_GROWN = 1.02
_DAMPING = 1e-3
_TINY = 1e-12


@dataclass(frozen=True)
class ImprintMotion:
    """What the object's imprint did on the skin in the last second or so.

    Attributes
    ----------
    lost : float
        How much of the imprint has left the place where it was printed, as a share of the energy
        of its pattern of light: 0 while the object sticks or is pressed harder, however the skin
        is dragged; 1 where it all went; more where that goes on.
    strength : float
        RMS of the pattern now, as a share of the light.
    moved_px : (float, float)
        How far the imprint went over the skin: +x right, +y down, in pixels of the image. To be
        compared rather than measured with: steps longer than the pattern is fine come out short.
    turned_rad : float
        How far it turned on the skin, positive from x towards y.
    radius_px : float
        Typical distance of the imprint from its own centre.
    """

    lost: float
    strength: float
    moved_px: tuple[float, float]
    turned_rad: float
    radius_px: float

    @property
    def degree(self) -> float:
        """0…1, and 0.5 where it is called slip; never quite 1, so that more still tells more."""
        return self.lost / (self.lost + SLIP_SHARE)

    @property
    def slips(self) -> bool:
        """The imprint has left its place."""
        return self.lost >= SLIP_SHARE

    @property
    def kind(self) -> Literal["translation", "rotation"]:
        """Which of the two moved the imprint further."""
        turned_px = abs(self.turned_rad) * self.radius_px
        return "rotation" if turned_px > np.hypot(*self.moved_px) else "translation"


class ImprintFollower:
    """Follows one object's imprint from frame to frame, over the skin.

    The imprint is compared with the strongest one seen at its place. Once more of it than noise
    explains is gone, the present one takes over and the loss is added up, so that neither the
    camera's rate nor the speed of the slip matters, and a contact that only settles counts once.
    Noise is what the two most alike neighbouring frames so far differ by, so a slip counts in full
    once a moment's rest was seen.

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        The image in which the markers are at ``reference_px``.
    reference_px : (N, 2)
        x and y of every marker; at least three.
    diameter_px : float
        Size of a marker.

    Raises
    ------
    InputError
        There are too few markers, or the diameter is not positive.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        self._view = SurfaceView(pixels, reference_px, diameter_px)
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self._held: _Imprint | None = None
        self._last: _Imprint | None = None
        self._noise = np.inf
        self._lost = 0.0
        self._moved = np.zeros(3)
        self._time_s = 0.0

    def settle(self) -> ImprintMotion:
        """Forget what was lost: pressing harder changes the imprint, too."""
        assert self._last is not None
        self._held, self._lost, self._moved = self._last, 0.0, np.zeros(3)
        return self._told(self._last, 0.0, np.zeros(3))

    def update(self, pixels: Array, px: Array, timestamp_s: float) -> ImprintMotion:
        """Take the next frame.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame, in the shape of the first.
        px : (N, 2)
            Where every marker is now, inferred ones included.
        timestamp_s : float
            When it was taken.

        Returns
        -------
        ImprintMotion
        """
        now = _Imprint(*self._view.imprint(pixels, px))
        held, last, self._last = self._held, self._last, now
        if held is None or last is None:
            self._held, self._time_s = now, timestamp_s
            return self._told(now, 0.0, np.zeros(3))
        fading = float(np.exp(-max(timestamp_s - self._time_s, 0.0) / _MEMORY_S))
        self._lost, self._moved = self._lost * fading, self._moved * fading
        self._time_s = timestamp_s
        self._noise = noise = min(self._noise, now.distance(last) / 2)
        was = held.energy_within(now) - noise
        lost = min(max(was - held.product(now), 0.0) / max(was, noise, _TINY), 1.0)
        step = _motion(held, now) if lost > _STEP_SHARE / 2 else np.zeros(3)
        if lost > _STEP_SHARE:
            self._lost, self._moved = self._lost + lost, self._moved + step
            lost, step = 0.0, np.zeros(3)
            self._held = now
        elif lost == 0 and now.energy_within(held) > _GROWN * (was + noise):
            self._held = now
        return self._told(now, lost, step)

    def _told(self, now: _Imprint, lost: float, step: Array) -> ImprintMotion:
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
    """The pattern of light (h, w, K) that an object prints on the skin, where it is seen (h, w)."""

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
        """Energy of what the other sees as well."""
        return float(np.vdot(self.square, other.seen))

    def distance(self, other: _Imprint) -> float:
        within = self.energy_within(other) + other.energy_within(self)
        return within - 2 * self.product(other)


def _motion(before: _Imprint, now: _Imprint) -> Array:
    """x, y and turn about the centre, small ones, that explain the change best."""
    half = (before.pattern + now.pattern) / 2
    across, down = gradient(half, smooth=True)
    x, y = before.centre
    columns = np.arange(half.shape[1], dtype=np.float32)[:, np.newaxis] - x
    rows = np.arange(half.shape[0], dtype=np.float32)[:, np.newaxis, np.newaxis] - y
    slopes = np.stack([-across, -down, across * rows - down * columns]).astype(np.float32)
    slopes *= (before.seen * now.seen)[..., np.newaxis]
    slopes = slopes.reshape(3, -1)
    normal = slopes @ slopes.T
    normal += np.diag(np.diag(normal)) * _DAMPING + np.eye(3) * _TINY
    change = (now.pattern - before.pattern).reshape(-1)
    return np.asarray(np.linalg.solve(normal, slopes @ change), np.float64)
