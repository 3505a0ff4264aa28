"""Marks on a virtual skin that is pressed, dragged, twisted and let go, as they are detected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.sim import VirtualStage

Array = NDArray[Any]

SIZE_PX = np.array([640, 480])
PITCH_PX = 1.1 / 0.0276
_BORDER_PX = 6
_CALM, _FIERCE = (1.0, 0.35), (2.0, 0.7)
"""In pitches: how far skin is dragged in all, and from one frame to the next."""


@dataclass(frozen=True)
class Strokes:
    """Where every printed mark is, frame by frame; ``rest_px`` is the first."""

    px: Array

    @property
    def rest_px(self) -> Array:
        return np.asarray(self.px[0])


def strokes(seed: int, *, fierce: bool) -> Strokes:
    """Press an object, drag it to and fro, twist it, drag it again, and lift it."""
    farthest, fastest_pitches = _FIERCE if fierce else _CALM
    rng = np.random.default_rng(seed)
    gel = {"friction": float(rng.uniform(0.5, 2)), "thickness_mm": float(rng.uniform(2, 3.5))}
    overrides: dict[str, Any] = {"gel": gel}
    if seed % 2:
        overrides["optics"] = {"marks": {"layout": "quasi_random"}}
    stage = VirtualStage("hex_fingertip", seed=seed, overrides=overrides)
    frames = [stage.truth().markers_px]
    fastest = rng.uniform(0.1, fastest_pitches) * PITCH_PX
    kind, options = [
        ("sphere", {"diameter_mm": rng.uniform(6, 16)}),
        ("flat", {"diameter_mm": rng.uniform(5, 12)}),
        ("cylinder", {"diameter_mm": rng.uniform(10, 38), "length_mm": 14.0}),
    ][seed % 3]
    x_mm, y_mm = rng.uniform(-3, 3), rng.uniform(-2, 2)
    stage.indenter(kind, x_mm=x_mm, y_mm=y_mm, angle_deg=rng.uniform(0, 180), **options)

    def dragged() -> float:
        return float(np.hypot(*(frames[-1] - frames[0]).T).max() / PITCH_PX)

    def take() -> None:
        # between two states of the skin there are as many frames as its speed takes
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
            if dragged() > farthest - 0.4:
                break
            stage.shear(0.35 * np.cos(direction), 0.35 * np.sin(direction))
            take()
        direction += rng.uniform(2, 4)
        sign = rng.choice([-1, 1])
        for _ in range(4 if turn == 0 else 0):
            if dragged() > farthest - 0.2:
                break
            stage.twist(sign * rng.uniform(2, 5))
            take()
    stage.press(depth_mm=depth_mm / 3)
    take()
    stage.release()
    take()
    return Strokes(np.array(frames))


def visible(places_px: Array) -> NDArray[np.bool_]:
    """Which places a detector can find, away from the image's border."""
    inside = (places_px > _BORDER_PX) & (places_px < SIZE_PX - 1 - _BORDER_PX)
    return np.asarray(inside.all(axis=1))


def detected(
    places_px: Array,
    rng: np.random.Generator,
    *,
    missing: float = 0.3,
    spurious: float = 0.05,
    noise_px: float = 0.1,
) -> tuple[Array, NDArray[np.intp]]:
    """Return shuffled detections, and the mark that each one shows; -1 for none."""
    marks = np.flatnonzero(visible(places_px) & (rng.random(len(places_px)) >= missing))
    others = rng.uniform(0, 1, (rng.poisson(spurious * len(marks)), 2)) * SIZE_PX
    found = np.concatenate([places_px[marks] + rng.normal(0, noise_px, (len(marks), 2)), others])
    whose = np.concatenate([marks, np.full(len(others), -1)])
    order = rng.permutation(len(found))
    return found[order], whose[order]
