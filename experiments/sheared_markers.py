"""Marker tracking on a virtual gel that is pressed, sheared, twisted and released."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.algorithms.markers.neighbourhood import nearest
from tactile_core.algorithms.markers.tracker import MarkerTracker
from tactile_sim import VirtualStage

Array = NDArray[Any]

SIZE_PX = np.array([640, 480])
PITCH_PX = 1.1 / 0.0276
"""Marker pitch of ``hex_fingertip``, px."""
_BORDER_PX = 6
"""Border of the image in which markers are not detected, px."""


@dataclass(frozen=True)
class Shear:
    """Difficulty of a tracking sequence, in pitches and shares of the markers.

    Attributes
    ----------
    farthest : float
        Largest marker displacement, pitches.
    fastest : float
        Largest marker displacement between two frames, pitches.
    spurious : float
        Spurious detections, as a share of the detected markers.
    missing : float
        Share of the markers that are not detected.
    noise_px : float
        Standard deviation of each coordinate.
    """

    farthest: float
    fastest: float
    spurious: float
    missing: float = 0.3
    noise_px: float = 0.1


@dataclass
class Tally:
    """Counts and errors of a tracker, summed over frames.

    Attributes
    ----------
    frames : int
    offered : int
        Detections of markers that are in the reference.
    seen : int
        Markers that the tracker reports as detected.
    swapped, specks : int
        Markers matched to the detection of another marker, or to a spurious detection.
    said : int
        Those of the swapped ones in frames that the tracker says to have been outrun in.
    squares_px, squares_of_right_px : float
        Squared distance from the truth, summed over all detected markers and over those that are
        matched correctly.
    """

    frames: int = 0
    offered: int = 0
    seen: int = 0
    swapped: int = 0
    said: int = 0
    specks: int = 0
    squares_px: float = 0.0
    squares_of_right_px: float = 0.0

    @property
    def recall(self) -> float:
        return self.seen / self.offered

    @property
    def rms_px(self) -> float:
        return float(np.sqrt(self.squares_px / self.seen))

    @property
    def rms_of_right_px(self) -> float:
        return float(np.sqrt(self.squares_of_right_px / (self.seen - self.swapped - self.specks)))

    def __str__(self) -> str:
        return (
            f"{self.frames} frames, {self.seen} markers matched, recall {self.recall:.1%}: "
            f"{self.swapped} swapped, {self.said} of them said, {self.specks} spurious, "
            f"{self.rms_px:.3f} px RMS, {self.rms_of_right_px:.3f} without these"
        )


def counted(shear: Shear, frames: int, first_seed: int = 0) -> Tally:
    """Track virtual sequences until they have this number of frames."""
    tally, seed = Tally(), first_seed
    while tally.frames < frames:
        follow(strokes(seed, shear), shear, np.random.default_rng([seed, 0]), tally)
        seed += 1
    return tally


def follow(positions_px: Array, shear: Shear, rng: np.random.Generator, tally: Tally) -> None:
    """Track the markers of (T, N, 2) positions from the first frame on, and add to the tally."""
    markers = np.flatnonzero(visible(positions_px[0]))
    tracker = MarkerTracker(positions_px[0][markers])
    for truth in positions_px:
        found, whose = detected(truth, shear, rng)
        tracker.update(found)
        seen = tracker.seen
        taken = whose[nearest(tracker.px[seen], found, 1)[1][:, 0]]
        squares = np.square(tracker.px - truth[markers])[seen].sum(axis=1)
        right = taken == markers[seen]
        tally.frames += 1
        tally.offered += int(np.isin(markers, whose).sum())
        tally.seen += int(seen.sum())
        swapped = int((~right & (taken >= 0)).sum())
        tally.swapped += swapped
        tally.said += swapped if tracker.outrun_pitches else 0
        tally.specks += int((taken < 0).sum())
        tally.squares_px += float(squares.sum())
        tally.squares_of_right_px += float(squares[right].sum())


def strokes(seed: int, shear: Shear) -> Array:
    """Press an object, shear it back and forth, twist it, shear it again, and release it.

    Returns
    -------
    (T, N, 2) float64
        Positions of all printed markers in every frame; the surface is undeformed in the first.
    """
    rng = np.random.default_rng(seed)
    gel = {"friction": float(rng.uniform(0.5, 2)), "thickness_mm": float(rng.uniform(2, 3.5))}
    overrides: dict[str, Any] = {"gel": gel}
    if seed % 2:
        overrides["optics"] = {"markers": {"layout": "quasi_random"}}
    stage = VirtualStage("hex_fingertip", seed=seed, overrides=overrides)
    frames = [stage.truth().markers_px]
    fastest = rng.uniform(0.1, shear.fastest) * PITCH_PX
    kind, options = [
        ("sphere", {"diameter_mm": rng.uniform(6, 16)}),
        ("flat", {"diameter_mm": rng.uniform(5, 12)}),
        ("cylinder", {"diameter_mm": rng.uniform(10, 38), "length_mm": 14.0}),
    ][seed % 3]
    x_mm, y_mm = rng.uniform(-3, 3), rng.uniform(-2, 2)
    stage.indenter(kind, x_mm=x_mm, y_mm=y_mm, angle_deg=rng.uniform(0, 180), **options)

    def sheared() -> float:
        return float(np.hypot(*(frames[-1] - frames[0]).T).max() / PITCH_PX)

    def take() -> None:
        # interpolate between two states with as many frames as the speed requires
        last, now = frames[-1], stage.truth().markers_px
        count = max(1, int(np.ceil(np.hypot(*(now - last).T).max() / fastest)))
        frames.extend(last + (now - last) * k / count for k in range(1, count + 1))

    depth_mm = rng.uniform(0.4, 1.1)
    for share in (0.5, 1.0):
        stage.press(depth_mm=depth_mm * share)
        take()
    direction = rng.uniform(0, 2 * np.pi)
    for turn in range(2):
        for _ in range(8):
            if sheared() > shear.farthest - 0.4:
                break
            stage.shear(0.35 * np.cos(direction), 0.35 * np.sin(direction))
            take()
        direction += rng.uniform(2, 4)
        sign = rng.choice([-1, 1])
        for _ in range(4 if turn == 0 else 0):
            if sheared() > shear.farthest - 0.2:
                break
            stage.twist(sign * rng.uniform(2, 5))
            take()
    stage.press(depth_mm=depth_mm / 3)
    take()
    stage.release()
    take()
    return np.array(frames)


def visible(positions_px: Array) -> NDArray[np.bool_]:
    """(N,) markers that are far enough from the image border to be detected."""
    inside = (positions_px > _BORDER_PX) & (positions_px < SIZE_PX - 1 - _BORDER_PX)
    return np.asarray(inside.all(axis=1))


def detected(
    positions_px: Array, shear: Shear, rng: np.random.Generator
) -> tuple[Array, NDArray[np.intp]]:
    """Return shuffled detections, and the index of each one's marker; -1 for spurious ones."""
    candidates = visible(positions_px) & (rng.random(len(positions_px)) >= shear.missing)
    markers = np.flatnonzero(candidates)
    others = rng.uniform(0, 1, (rng.poisson(shear.spurious * len(markers)), 2)) * SIZE_PX
    noise_px = rng.normal(0, shear.noise_px, (len(markers), 2))
    found = np.concatenate([positions_px[markers] + noise_px, others])
    whose = np.concatenate([markers, np.full(len(others), -1)])
    order = rng.permutation(len(found))
    return found[order], whose[order]
