"""``example_lights.box``: the box that switches the lights."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import Field

from tactile_core import DeviceError, LightDriver
from tactile_core.interfaces.device import Options
from tactile_example_lights.bench import AZIMUTH_DEG, Bench


class BoxOptions(Options):
    """Where the box is."""

    port: str = Field(default="loop", description="The port that it is plugged in at.")


class LightBox(LightDriver):
    """Takes one line for all its lights and answers when they have settled."""

    Options = BoxOptions

    def __init__(self, options: BoxOptions) -> None:
        super().__init__(options)
        self._bench: Bench | None = None

    def _open(self) -> None:
        self._bench = Bench.at(self.options.port)

    def _close(self) -> None:
        self._bench = None

    def _set(self, levels: Mapping[str, float]) -> None:
        said = dict.fromkeys(AZIMUTH_DEG, 0.0) | dict(levels)
        line = " ".join(f"{name}={round(255 * level)}" for name, level in said.items())
        answer = self._bench.send(line)
        if answer != "ok":
            raise DeviceError(
                f"the light box at {self.options.port} answers {answer!r}; correct the names of "
                f"'illumination.lights' in the profile"
            )
