"""Lights that each do one thing wrong."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count

from tactile_core.errors import DeviceError
from tactile_core.interfaces.illumination import Exposure, Illumination


class Lights(Illumination):
    """Two lamps fired in turn; sound."""

    channels = ("left", "right")

    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({name: 1.0}, (name,)) for name in self.channels)

    def _open(self) -> None:
        pass

    def _close(self) -> None:
        pass

    def _set(self, levels: Mapping[str, float]) -> None:
        pass


class SameChannels(Lights):
    channels = ("white", "white")


class Uncovered(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return super().exposures()[:1]


class TooBright(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({name: 255}, (name,)) for name in self.channels)


class Unlit(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({}, (name,)) for name in self.channels)


class Unsteady(Lights):
    def __init__(self, options: object) -> None:
        super().__init__(options)
        self._asked = count()

    def exposures(self) -> tuple[Exposure, ...]:
        level = 1.0 / (1 + next(self._asked))
        return tuple(Exposure({name: level}, (name,)) for name in self.channels)


class Disobedient(Lights):
    def _set(self, levels: Mapping[str, float]) -> None:
        raise DeviceError("no lamp of this name")


class Unguarded(Lights):
    def set(self, levels: Mapping[str, float]) -> None:
        self._set(levels)
