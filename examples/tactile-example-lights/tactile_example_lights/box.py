"""``example_lights.box``: the driver of the light box."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import Field

from tactile_core import DeviceError, LightDriver
from tactile_core.interfaces.device import Options
from tactile_example_lights.bench import AZIMUTH_DEG, Bench


class BoxOptions(Options):
    """Options of :class:`LightBox`."""

    port: str = Field(default="loop", description="Port of the light box.")


class LightBox(LightDriver):
    """Sets all lights with one command; the box answers when they have settled."""

    Options = BoxOptions

    def __init__(self, options: BoxOptions) -> None:
        super().__init__(options)
        self._bench: Bench | None = None

    def _open(self) -> None:
        self._bench = Bench.at(self.options.port)

    def _close(self) -> None:
        self._bench = None

    def _set(self, levels: Mapping[str, float]) -> None:
        all_levels = dict.fromkeys(AZIMUTH_DEG, 0.0) | dict(levels)
        line = " ".join(f"{name}={round(255 * level)}" for name, level in all_levels.items())
        answer = self._bench.send(line)
        if answer != "ok":
            raise DeviceError(
                f"the light box at {self.options.port} answers {answer!r}; correct the names of "
                f"'illumination.lights' in the profile"
            )
