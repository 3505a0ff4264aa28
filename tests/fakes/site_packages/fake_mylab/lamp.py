"""One light that never changes."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.illumination import Exposure, Illumination


class Lamp(Illumination):
    channels = ("grey",)

    def exposures(self) -> tuple[Exposure, ...]:
        return (Exposure({"lamp": 1.0}, ("grey",)),)

    def _open(self) -> None:
        self.shining: dict[str, float] = {}

    def _close(self) -> None:
        self.shining = {}

    def _set(self, levels: Mapping[str, float]) -> None:
        self.shining = dict(levels)
