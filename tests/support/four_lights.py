"""Balls under four lights, rendered with ground truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_core.interfaces.calibration import Press
from tactile_core.quantities import Frame, Reference

CHANNELS = ("red", "green", "blue")
HEIGHT, WIDTH, SCALE_MM, RADIUS_PX = 120, 160, 0.1, 26.0
_LIGHTS = ((-90.0, (1, 0, 0)), (0.0, (0, 1, 0)), (90.0, (0, 0, 1)), (180.0, (0.67, 0.67, 0.67)))


@dataclass(frozen=True)
class Ball:
    """A ball at a position, with slopes within 0.8 of its radius."""

    centre_px: tuple[float, float]

    def slopes(self) -> tuple[np.ndarray, np.ndarray]:
        """(H, W, 2) slopes, 0 off the ball, and the (H, W) mask of the ball."""
        x = np.arange(WIDTH) - self.centre_px[0]
        y = np.arange(HEIGHT)[:, None] - self.centre_px[1]
        square = np.maximum(RADIUS_PX**2 - x**2 - y**2, 1.0)
        on = np.hypot(x, y) < 0.8 * RADIUS_PX
        both = np.stack(np.broadcast_arrays(-x, -y), -1) / np.sqrt(square)[..., None]
        return np.where(on[..., None], both, 0.0), on


def shine(slopes: np.ndarray, *, mirrored: bool = False, gain: float = 1.0) -> np.ndarray:
    """(H, W, 3) bytes of a Lambertian surface; each light is a third brighter on its own side."""
    normal = np.concatenate([-slopes, np.ones((*slopes.shape[:2], 1))], 2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    x = np.linspace(-1, 1, slopes.shape[1])
    y = np.linspace(-1, 1, slopes.shape[0])[:, None]
    total = np.full((*slopes.shape[:2], 3), 10.0)
    for azimuth_deg, colour in _LIGHTS:
        azimuth, elevation = np.radians([-azimuth_deg if mirrored else azimuth_deg, 50.0])
        to = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(elevation)]) * np.cos(elevation)
        fade = 1 + 0.3 * (x * to[0] + y * to[1])
        total += 75 * (fade * np.maximum(normal @ to, 0))[..., None] * np.asarray(colour)
    return np.clip(np.rint(gain * total), 0, 255).astype(np.uint8)


def frame_of(ball: Ball | None, *, mirrored: bool = False, gain: float = 1.0) -> Frame:
    """A frame with one ball, or without."""
    slopes = ball.slopes()[0] if ball is not None else np.zeros((HEIGHT, WIDTH, 2))
    return Frame(shine(slopes, mirrored=mirrored, gain=gain), CHANNELS, SCALE_MM)


def undeformed(*, mirrored: bool = False) -> Reference:
    """The undeformed gel surface."""
    return Reference(frame_of(None, mirrored=mirrored).pixels.astype(np.float32), CHANNELS)


def presses(count: int, *, mirrored: bool = False) -> list[Press]:
    """Balls at random positions, each with a quarter as many undeformed pixels."""
    rng = np.random.default_rng(3)
    made = []
    for number in range(count):
        ball = Ball((float(rng.uniform(25, 135)), float(rng.uniform(25, 95))))
        slopes, on = ball.slopes()
        rows, columns = np.nonzero(on)
        level = rng.permutation(np.argwhere(np.hypot(*slopes.transpose(2, 0, 1)) == 0))
        level = level[: len(rows) // 4]
        rows, columns = np.concatenate([rows, level[:, 0]]), np.concatenate([columns, level[:, 1]])
        made.append(
            Press(
                frame_of(ball, mirrored=mirrored),
                rows.astype(np.int32),
                columns.astype(np.int32),
                slopes[rows, columns].astype(np.float32),
                f"ball {number}",
            )
        )
    return made
