"""Whether the imprint of the object stays where it was printed on the skin.

The 2015 paper compares the motion of the marks with that of the object's own texture: where they
part, the object slips [Yuan 2015]. Here both are told from one image. It is drawn back along the
marks, so that the skin stands still, and what then still moves has left its place on the skin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.slip.skin_view import SkinView

Array = NDArray[Any]
Float32 = NDArray[np.float32]

SLIP_SHARE = 0.4
"""Slip is where this much of the imprint has left its place within about a second."""

_MEMORY_S = 1.0
"""What was lost is forgotten: a grasp that held again is no longer slipping."""

_STEP_SHARE = 0.05
"""Losses are added up in steps of this size, so that noise, which comes and goes, is not."""

_GROWN = 1.02
_GRASPED_ANEW = 2.0
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
        How far the imprint went over the skin since the object was grasped: +x right, +y down,
        in pixels of the image.
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

    Parameters
    ----------
    pixels : (H, W) or (H, W, K)
        The image in which the marks are at ``reference_px``.
    reference_px : (N, 2)
        x and y of every mark; at least three.
    diameter_px : float
        Size of a mark.

    Raises
    ------
    InputError
        There are too few marks, or the diameter is not positive.
    """

    def __init__(self, pixels: Array, reference_px: Array, diameter_px: float) -> None:
        self._view = SkinView(pixels, reference_px, diameter_px)
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self._held: _Held | None = None
        self._noise = np.inf
        self._weakest = np.inf
        self._lost = 0.0
        self._moved = np.zeros(3)
        self._time_s = 0.0

    def update(self, pixels: Array, px: Array, timestamp_s: float) -> ImprintMotion:
        """Take the next frame.

        Parameters
        ----------
        pixels : (H, W) or (H, W, K)
            The frame, in the shape of the first.
        px : (N, 2)
            Where every mark is now, inferred ones included.
        timestamp_s : float
            When it was taken.

        Returns
        -------
        ImprintMotion
        """
        now = _Imprint(*self._view.imprint(pixels, px))
        self._lost *= np.exp(-max(timestamp_s - self._time_s, 0.0) / _MEMORY_S)
        self._time_s = timestamp_s
        self._weakest = min(self._weakest, now.energy)
        if self._held is None or now.energy > _GRASPED_ANEW * self._weakest + _TINY:
            self._grasp(now)
            return self._motion(now, 0.0, np.zeros(3))
        self._noise = min(self._noise, now.distance(self._last) / 2)
        self._last = now
        held, was = self._held, self._held.imprint.energy_within(now) - self._noise
        kept = held.imprint.product(now)
        lost = max(was - kept, 0.0) / max(was, _TINY)
        step = held.motion(now) if lost > _STEP_SHARE / 2 else np.zeros(3)
        if lost > _STEP_SHARE:
            self._lost, self._moved = self._lost + lost, self._moved + step
            lost, step = 0.0, np.zeros(3)
            self._held = _Held(now)
        elif lost == 0 and now.energy_within(held.imprint) > _GROWN * (was + self._noise):
            self._held = _Held(now)
        return self._motion(now, lost, step)

    def _grasp(self, now: _Imprint) -> None:
        self._held, self._last = _Held(now), now
        self._weakest = now.energy
        self._lost, self._moved = 0.0, np.zeros(3)

    def _motion(self, now: _Imprint, lost: float, step: Array) -> ImprintMotion:
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
        self.square = np.einsum("ijk,ijk->ij", pattern, pattern)
        self.energy = float(self.square.sum())
        self.count = float(seen.sum()) * pattern.shape[2]

    def product(self, other: _Imprint) -> float:
        return float(np.vdot(self.pattern, other.pattern))

    def energy_within(self, other: _Imprint) -> float:
        """Energy of what the other sees as well."""
        return float(np.vdot(self.square, other.seen))

    def distance(self, other: _Imprint) -> float:
        within = self.energy_within(other) + other.energy_within(self)
        return within - 2 * self.product(other)

    @property
    def centre(self) -> tuple[float, float]:
        columns, rows = np.arange(self.square.shape[1]), np.arange(self.square.shape[0])
        total = max(self.energy, _TINY)
        x = float(self.square.sum(axis=0) @ columns) / total
        return x, float(self.square.sum(axis=1) @ rows) / total

    @property
    def radius(self) -> float:
        (x, y), total = self.centre, max(self.energy, _TINY)
        columns, rows = np.arange(self.square.shape[1]), np.arange(self.square.shape[0])
        spread = self.square.sum(axis=0) @ (columns - x) ** 2
        spread += self.square.sum(axis=1) @ (rows - y) ** 2
        return float(np.sqrt(spread / total))


class _Held:
    """The imprint that later ones are compared with, and how it would change if it moved."""

    def __init__(self, imprint: _Imprint) -> None:
        self.imprint = imprint
        self._slopes: Float32 | None = None

    def motion(self, now: _Imprint) -> Array:
        """x, y and turn about the imprint's centre that explain the change best; small ones."""
        slopes = self._along()
        both = (now.seen * self.imprint.seen)[..., np.newaxis]
        weighted = slopes.reshape(3, -1) * np.broadcast_to(both, now.pattern.shape).reshape(-1)
        change = (now.pattern - self.imprint.pattern).reshape(-1)
        normal = weighted @ slopes.reshape(3, -1).T
        normal += np.diag(np.diag(normal)) * 1e-3 + np.eye(3) * _TINY
        return np.linalg.solve(normal, weighted @ change).astype(np.float64)

    def _along(self) -> Float32:
        """(3, h, w, K) change of the pattern for a unit of each motion."""
        if self._slopes is None:
            pattern = self.imprint.pattern
            across = cv2.Sobel(pattern, cv2.CV_32F, 1, 0, scale=1 / 8).reshape(pattern.shape)
            down = cv2.Sobel(pattern, cv2.CV_32F, 0, 1, scale=1 / 8).reshape(pattern.shape)
            x, y = self.imprint.centre
            columns = np.arange(pattern.shape[1], dtype=np.float32)[:, np.newaxis] - x
            rows = np.arange(pattern.shape[0], dtype=np.float32)[:, np.newaxis, np.newaxis] - y
            self._slopes = -np.stack([across, down, down * columns - across * rows])
        return self._slopes
