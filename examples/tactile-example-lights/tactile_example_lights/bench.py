"""What stands in for hardware: a gel, a ball, four lights, and a port that takes lines of text."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

AZIMUTH_DEG = {"east": 0, "south": 90, "west": 180, "north": 270}
ELEVATION_DEG = 45
HEIGHT_PX, WIDTH_PX, MM_PER_PX = 120, 160, 0.05
BALL_RADIUS_MM, DEPTH_MM = 4.0, 0.4
FULL, AMBIENT = 180.0, 20.0


class Bench:
    """One bench; ``Bench.at("loop")`` is the one that is plugged in there."""

    _plugged_in: ClassVar[dict[str, Bench]] = {}

    def __init__(self) -> None:
        self.brightness: dict[str, int] = {}
        self.lines: list[str] = []

    @classmethod
    def at(cls, port: str) -> Bench:
        """Return what is plugged in at a port."""
        return cls._plugged_in.setdefault(port, cls())

    def send(self, line: str) -> str:
        """Take ``"east=255 west=0"`` and answer ``"ok"``, or say what is wrong."""
        said = dict(word.split("=") for word in line.split())
        unknown = sorted(set(said) - set(AZIMUTH_DEG))
        if unknown:
            return f"no light {unknown[0]}"
        self.lines.append(line)
        self.brightness = {name: int(value) for name, value in said.items()}
        return "ok"

    def picture(self, *, touched: bool) -> NDArray[np.uint8]:
        """(H, W) uint8: what the camera sees of a Lambertian gel in the light of this moment."""
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
