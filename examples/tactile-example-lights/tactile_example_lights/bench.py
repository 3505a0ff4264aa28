"""A simulation of the hardware: a gel, a ball, four lights, and a port for text commands."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

AZIMUTH_DEG = {"east": 0, "south": 90, "west": 180, "north": 270}
"""Azimuth of each light, degrees."""

ELEVATION_DEG = 45
"""Elevation of all lights, degrees."""

HEIGHT_PX, WIDTH_PX, MM_PER_PX = 120, 160, 0.05
"""Size of the image, px, and its scale, mm/px."""

BALL_RADIUS_MM, DEPTH_MM = 4.0, 0.4
"""Radius of the ball and its indentation, mm."""

FULL, AMBIENT = 180.0, 20.0
"""Intensity of one light at full brightness and of the ambient light, grey levels."""


class Bench:
    """A simulated bench; ``Bench.at("loop")`` is the one at the port ``loop``."""

    _connected: ClassVar[dict[str, Bench]] = {}

    def __init__(self) -> None:
        self.brightness: dict[str, int] = {}
        self.lines: list[str] = []

    @classmethod
    def at(cls, port: str) -> Bench:
        """Return the bench at a port."""
        return cls._connected.setdefault(port, cls())

    def send(self, line: str) -> str:
        """Process a command like ``"east=255 west=0"``; return ``"ok"`` or an error message."""
        levels = dict(word.split("=") for word in line.split())
        unknown = sorted(set(levels) - set(AZIMUTH_DEG))
        if unknown:
            return f"no light {unknown[0]}"
        self.lines.append(line)
        self.brightness = {name: int(value) for name, value in levels.items()}
        return "ok"

    def picture(self, *, touched: bool) -> NDArray[np.uint8]:
        """Return the (H, W) uint8 image of a Lambertian gel under the current lights."""
        y, x = np.mgrid[:HEIGHT_PX, :WIDTH_PX].astype(float)
        x, y = (x - (WIDTH_PX - 1) / 2) * MM_PER_PX, (y - (HEIGHT_PX - 1) / 2) * MM_PER_PX
        ball = np.sqrt(np.maximum(BALL_RADIUS_MM**2 - x**2 - y**2, 0)) - BALL_RADIUS_MM + DEPTH_MM
        height_mm = np.maximum(ball, 0) * touched
        dy, dx = np.gradient(height_mm, MM_PER_PX)
        length = np.sqrt(dx**2 + dy**2 + 1)
        light = np.full_like(x, AMBIENT)
        elevation = np.radians(ELEVATION_DEG)
        for name, brightness in self.brightness.items():
            azimuth = np.radians(AZIMUTH_DEG[name])
            along = -dx * np.cos(azimuth) - dy * np.sin(azimuth)
            facing = (np.cos(elevation) * along + np.sin(elevation)) / length
            light += brightness / 255 * FULL * np.maximum(facing, 0)
        return np.rint(light).clip(0, 255).astype(np.uint8)
