"""Touches: what a press has shown, where to press next, and what is said about it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tactile_core.algorithms.arrays.types import Float64
from tactile_core.algorithms.circles.circle import Circle
from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.guided.background import TouchChange, UndeformedCells
from tactile_core.quantities import Frame


class TOUCH:
    """Parameters of following touches.

    Nothing sets them from outside: they are ratios and times.
    """

    # [s] A press is still if it does not change for this time. Source: by hand: a hand that
    # stops for less is about to move.
    still_s = 0.3
    # [count] Frames of that time, at least. The middle one is kept: nothing moved before or after
    # it, so nothing moved during the exposures of a sequence either. Source: definition; three
    # are the fewest with a middle.
    still_frames = 4
    # [ball radii] A touch whose imprint has moved further has slid. Source: virtual rigs
    # (``benchmarks/guided_calibration.py``).
    slide_balls = 0.3


@dataclass(frozen=True, eq=False)
class Still:
    """A press that held still.

    Attributes
    ----------
    frame : Frame
        The middle one of the frames in which nothing moved.
    slid_balls : float
        How far the imprint had moved until then.
    middle_px : (2,) float64
        Middle of the imprint.
    """

    frame: Frame
    slid_balls: float
    middle_px: Float64


class Touches:
    """Follows what touches the gel from frame to frame.

    Parameters
    ----------
    ball_radius_px : float

    Attributes
    ----------
    touching : bool
    since_still : bool
        The touch has been still; it has to end before another press can begin.
    ended_restless : bool
        The latest frame ended a touch that was never still.
    """

    def __init__(self, ball_radius_px: float) -> None:
        self._ball_px = ball_radius_px
        self._recent: deque[tuple[Frame, TouchChange]] = deque()
        self._path: list[tuple[float, np.ndarray]] = []
        # [count] Latest frames without a touch whose median change is the noise
        self._quiet: deque[float] = deque(maxlen=50)
        self.touching = self.since_still = False
        self.ended_restless = False

    @property
    def noise(self) -> float:
        """Median change of the latest frames in which nothing touched; 0 before there are any."""
        return float(np.median(self._quiet)) if self._quiet else 0.0

    def add(self, frame: Frame, change: TouchChange) -> Still | None:
        """Add a frame; return the press if it has just become still."""
        self.ended_restless = False
        # [logarithm of the intensity] A stronger change is a touch. Source: chosen on virtual rigs
        # (``benchmarks/guided_calibration.py``).
        # [ratio] The same, over the change while nothing touches. Source: chosen on virtual rigs
        # (``benchmarks/guided_calibration.py``).
        least = max(0.05, 2.5 * self.noise)
        # [ratio] With a change below this share of that of a touch, the touch has ended. Source: by
        # hand, so that noise between the two is neither.
        if change.strength < least * (0.6 if self.touching else 1):
            self._quiet.append(change.strength)
            self.ended_restless = self.touching and not self.since_still and len(self._path) > 2
            self.touching = self.since_still = False
            self._recent.clear()
            self._path.clear()
            return None
        self.touching = True
        self._path.append((change.strength, change.middle_px))
        if self.since_still:
            return None
        self._recent.append((frame, change))
        while (
            len(self._recent) > TOUCH.still_frames
            and frame.timestamp_s - self._recent[1][0].timestamp_s >= TOUCH.still_s
        ):
            self._recent.popleft()
        if not self._is_still(frame, change):
            return None
        self.since_still = True
        middle = self._recent[len(self._recent) // 2][0]
        self._recent.clear()
        return Still(middle, self._slid(change), change.middle_px)

    def _is_still(self, frame: Frame, change: TouchChange) -> bool:
        first = self._recent[0][0]
        if (
            len(self._recent) < TOUCH.still_frames
            or frame.timestamp_s - first.timestamp_s < TOUCH.still_s
        ):
            return False
        # [ratio] Largest change of the imprint between any frame of that time and the last,
        # relative to the imprint, besides noise. Source: chosen on virtual rigs
        # (``benchmarks/guided_calibration.py``): a tremor by 1 % of the depth changes 0.02 to 0.1,
        # a slide by a tenth of the ball's radius 0.25 and more.
        largest = float(np.hypot(0.13, self.noise / change.strength))
        return all(change.motion(earlier) <= largest for _, earlier in self._recent)

    def _slid(self, last: TouchChange) -> float:
        # [ratio] The position of an imprint counts if it is this strong, relative to when it is
        # still: before, contact is a point, and noise moves it. Source: virtual rigs
        # (``benchmarks/guided_calibration.py``).
        away = [
            float(np.hypot(*(middle - last.middle_px)))
            for strength, middle in self._path
            if strength >= 0.6 * last.strength
        ]
        return max(away, default=0.0) / self._ball_px


def next_touch(frames: Iterable[Frame], bundle: Bundle) -> Frame | None:
    """Return the frame in which the next thing that touches holds still.

    What touches already at the beginning does not count.

    Parameters
    ----------
    frames : iterable of Frame
        Live, in order.
    bundle : Bundle
        The calibration, made with a ball.

    Returns
    -------
    Frame or None
        None if the frames end before.
    """
    manifest = bundle.manifest
    assert bundle.reference is not None
    ball_px = min(manifest.ball_diameters_mm) / 2 / manifest.mm_per_px
    cells, touches = UndeformedCells(bundle.reference, ball_px), Touches(ball_px)
    lifted = False
    for frame in frames:
        still = touches.add(frame, cells.change(frame))
        lifted |= not touches.touching
        if still is not None and lifted:
            return still.frame
    return None


# What the person should do: let go, press at the target, hold still, lift, or nothing more.
State = Literal["hands_off", "press", "hold", "lift", "done"]


@dataclass(frozen=True, eq=False)
class Guidance:
    """Plain data after one frame; a view draws it as it likes.

    Attributes
    ----------
    say : str
        One sentence: what to do now.
    state : {"hands_off", "press", "hold", "lift", "done"}
    target_px : (float, float) or None
        Where to press next; None before the undeformed gel was seen, and when all is done.
    target_radius_px : float
        Press until the contact is as large as this circle.
    imprint_px : (float, float) or None
        Middle of what touches now.
    circle : Circle or None
        Contact circle of the press that was examined last.
    kept : int
        Presses that are kept.
    attempts : int
        Touches that have ended, or were judged.
    refused : str or None
        Why the last press was not kept; None if it was, or is being examined.
    examining : bool
        A press is being examined.
    coverage : (rows, columns) float64
        How well each part of the view is covered, 0 to 1.
    slope_coverage : (rings, regions) float64
        Share of the presses with slopes of each ring of steepness, in each region of the view.
    held_out : float or None
        Mean error of the normals of the latest presses, degrees: each with a calibration on those
        before it.
    held_out_each : tuple of float
        The same error of each press that was scored, in order.
    warning : str or None
        What is wrong beside the presses, such as a light that has changed.
    done : bool
        More presses would not help.
    """

    say: str
    state: State
    target_px: tuple[float, float] | None
    target_radius_px: float
    imprint_px: tuple[float, float] | None
    circle: Circle | None
    kept: int
    attempts: int
    refused: str | None
    examining: bool
    coverage: np.ndarray
    slope_coverage: np.ndarray
    held_out: float | None
    held_out_each: tuple[float, ...]
    warning: str | None
    done: bool

    def summary(self) -> dict[str, Any]:
        """Return the line of ``tactile calibrate --live --json``: strict JSON."""
        circle = self.circle
        return {
            "say": self.say,
            "state": self.state,
            "target_px": None if self.target_px is None else [round(v, 1) for v in self.target_px],
            "target_radius_px": round(self.target_radius_px, 1),
            "circle": None
            if circle is None
            else {
                "centre_px": [round(v, 2) for v in circle.centre_px],
                "contact_radius_px": round(circle.contact_radius_px, 2),
            },
            "kept": self.kept,
            "attempts": self.attempts,
            "refused": self.refused,
            "coverage": round(float((self.coverage >= 1).mean()), 4),
            "slope_coverage": round(float(self.slope_coverage.mean()), 4),
            "held_out": None if self.held_out is None else round(self.held_out, 4),
            "warning": self.warning,
            "done": self.done,
        }
