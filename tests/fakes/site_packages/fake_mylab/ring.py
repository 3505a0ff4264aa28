"""One light that never changes, and a box that could switch it."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import Field

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination
from tactile_core.interfaces.light_driver import LightDriver


class Ring(Illumination):
    channels = ("grey",)

    def exposures(self) -> tuple[Exposure, ...]:
        return (Exposure({"ring": 1.0}, ("grey",)),)


class BoxOptions(Options):
    port: str = Field(default="loop", description="Where it is plugged in.")
    baud: int = Field(default=9600, gt=0, description="Its speed.")


class Box(LightDriver):
    Options = BoxOptions

    def _open(self) -> None:
        self.shining: dict[str, float] = {}

    def _close(self) -> None:
        self.shining = {}

    def _set(self, levels: Mapping[str, float]) -> None:
        self.shining = dict(levels)
