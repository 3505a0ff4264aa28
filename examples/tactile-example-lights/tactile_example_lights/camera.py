"""``example_lights.camera``: the camera of the bench, with fixed settings."""

from __future__ import annotations

import time

from pydantic import Field

from tactile_core import Camera, Image
from tactile_core.interfaces.device import Options
from tactile_example_lights.bench import Bench


class CameraOptions(Options):
    """Options of :class:`BenchCamera`."""

    port: str = Field(default="loop", description="Port of the camera.")
    touched_from: int = Field(
        default=5, ge=0, description="Number of the first image with a pressed ball."
    )


class BenchCamera(Camera):
    """Takes images of the gel under the current lights."""

    Options = CameraOptions

    @property
    def device_id(self) -> str:
        """The port, which identifies the camera."""
        return self.options.port

    def _open(self) -> None:
        self._bench = Bench.at(self.options.port)
        self._taken = 0

    def _close(self) -> None:
        """Do nothing: there are no resources to release."""

    def _read(self, timeout_s: float) -> Image:
        pixels = self._bench.picture(touched=self._taken >= self.options.touched_from)
        self._taken += 1
        return Image(pixels, time.monotonic(), time.time(), self._taken - 1, exposure_time_s=0.01)
