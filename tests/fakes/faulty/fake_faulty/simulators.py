"""Simulators that each do one thing wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_core.formats.images import write_png
from tactile_core.interfaces.component import SensorBuild
from tactile_core.interfaces.simulator import Renderer, Simulator
from tactile_core.quantities import Frame


class Grey(Renderer):
    """Renders a grey image."""

    channels = ("red", "green", "blue")
    full_scale = 255.0

    def take_frame(
        self,
        height_mm: NDArray[Any],
        displacement_mm: NDArray[Any] | None = None,
        *,
        number: int,
        time_s: float = 0.0,
    ) -> Frame:
        pixels = np.full((*self.shape(height_mm), len(self.channels)), 128.0, np.float32)
        return Frame(pixels + self.noise(number), self.channels, 0.1, timestamp_s=time_s)

    def shape(self, height_mm: NDArray[Any]) -> tuple[int, ...]:
        return height_mm.shape

    def noise(self, number: int) -> float:
        return float(number)


class Smooth(Simulator):
    """Does nothing wrong."""

    optics: type[Grey] = Grey

    def renderer(self, build: SensorBuild, *, seed: int = 0) -> Renderer:
        return self.optics()

    def write_script(self, build: SensorBuild, path: Path, *, ball_diameter_mm: float) -> None:
        path.touch()

    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        for name in ("presses", "reference"):
            (folder / name).mkdir()
            size = (build.image.height_px, build.image.width_px, 3)
            write_png(folder / name / "one.png", np.full(size, 128, np.uint8))
        return 4.0


class Forgetful(Smooth):
    """Writes no reference."""

    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        ball_mm = super().write_presses(build, folder, count=count)
        (folder / "reference" / "one.png").unlink()
        return ball_mm


class Point(Smooth):
    """Presses no ball."""

    def write_presses(self, build: SensorBuild, folder: Path, *, count: int) -> float:
        return 0 * super().write_presses(build, folder, count=count)


class Half(Grey):
    def shape(self, height_mm: NDArray[Any]) -> tuple[int, ...]:
        return tuple(side // 2 for side in height_mm.shape)


class Small(Smooth):
    """Renders images of another size."""

    optics = Half


class Unseeded(Grey):
    def noise(self, number: int) -> float:
        return float(np.random.default_rng().normal())


class Noisy(Smooth):
    """Renders another noise each time."""

    optics = Unseeded
