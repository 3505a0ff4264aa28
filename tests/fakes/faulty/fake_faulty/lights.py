"""Illuminations that each do one thing wrong."""

from __future__ import annotations

from itertools import count

from tactile_core.interfaces.illumination import Exposure, Illumination, Light


class Lights(Illumination):
    """Two sequential lights; valid."""

    channels = ("left", "right")
    lights = (Light("left", 180, 30), Light("right", 0, 30))

    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({name: 1.0}, (name,)) for name in self.channels)


class SameChannels(Lights):
    channels = ("white", "white")
    lights = ()


class Uncovered(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return super().exposures()[:1]


class TooBright(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({name: 255}, (name,)) for name in self.channels)


class Unlit(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({}, (name,)) for name in self.channels)


class Endless(Lights):
    def exposures(self) -> tuple[Exposure, ...]:
        return tuple(Exposure({n: 1.0}, (n,), exposure_time_s=0.0) for n in self.channels)


class SameLights(Lights):
    lights = (Light("left", 180, 30), Light("left", 0, 30))


class Missing(Lights):
    lights = (Light("left", 180, 30),)


class Unsteady(Lights):
    def __init__(self, options: object) -> None:
        super().__init__(options)
        self._asked = count()

    def exposures(self) -> tuple[Exposure, ...]:
        level = 1.0 / (1 + next(self._asked))
        return tuple(Exposure({name: level}, (name,)) for name in self.channels)


class Holding(Lights):
    def __init__(self, options: object) -> None:
        super().__init__(options)
        self._port = (line for line in ())
