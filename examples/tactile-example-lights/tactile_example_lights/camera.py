"""``example_lights.camera``: the camera over the gel, which takes one picture like the other."""

from __future__ import annotations

import time

from pydantic import Field

from tactile_core import Camera, Image
from tactile_core.interfaces.device import Options
from tactile_example_lights.bench import Bench


class CameraOptions(Options):
    """Which camera, and what happens before it."""

    port: str = Field(default="loop", description="The port that it is plugged in at.")
    touched_from: int = Field(
        default=5, ge=0, description="The first picture on which a ball presses."
    )


class BenchCamera(Camera):
    """Sees the gel in whatever light there is."""

    Options = CameraOptions

    @property
    def device_id(self) -> str:
        """The port: there is one camera at each."""
        return self.options.port

    def _open(self) -> None:
        self._bench = Bench.at(self.options.port)
        self._taken = 0

    def _close(self) -> None:
        """The bench has nothing to release."""

    def _read(self, timeout_s: float) -> Image:
        pixels = self._bench.picture(touched=self._taken >= self.options.touched_from)
        self._taken += 1
        return Image(pixels, time.monotonic(), time.time(), self._taken - 1, exposure_time_s=0.01)
