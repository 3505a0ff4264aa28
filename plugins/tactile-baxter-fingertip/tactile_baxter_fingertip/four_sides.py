"""Four arrays of LEDs, one on each side, whose light shares three channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import BaseModel, Field, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination

CHANNELS = ("red", "green", "blue")


class Array(Options):
    """One 1 × 8 array of LEDs of one colour."""

    name: str = Field(min_length=1, description="The colour.")
    azimuth_deg: float = Field(description="Where it stands, from x towards y.")
    elevation_deg: float = Field(
        default=20.0, gt=0, lt=90, description="Angle of its light to the skin."
    )
    feeds: tuple[str, ...] = Field(
        min_length=1, description="The channels that see it: red, green, blue, or all of them."
    )

    @model_validator(mode="after")
    def _feeds_the_camera(self) -> Array:
        unknown = sorted(set(self.feeds) - set(CHANNELS))
        if unknown or len(set(self.feeds)) < len(self.feeds):
            raise ValueError(f"feeds some of {', '.join(CHANNELS)}, each once")
        return self


class FourSidesOptions(Options):
    """Options of ``baxter_fingertip.four_sides``."""

    lights: tuple[Array, Array, Array, Array] = Field(
        default=(
            Array(name="red", azimuth_deg=-90, feeds=("red",)),
            Array(name="green", azimuth_deg=0, feeds=("green",)),
            Array(name="blue", azimuth_deg=90, feeds=("blue",)),
            Array(name="white", azimuth_deg=180, feeds=CHANNELS),
        ),
        description="The arrays.",
    )

    @model_validator(mode="after")
    def _every_channel_is_lit(self) -> FourSidesOptions:
        if len({light.name for light in self.lights}) < len(self.lights):
            raise ValueError("four arrays need four different names")
        dark = sorted(set(CHANNELS) - {name for light in self.lights for name in light.feeds})
        if dark:
            raise ValueError(f"no array feeds {', '.join(dark)}")
        return self


class FourSides(Illumination):
    """The arrays are wired to the supply: they shine together whenever the sensor is plugged in."""

    Options: ClassVar[type[BaseModel]] = FourSidesOptions
    options: FourSidesOptions

    @property
    def channels(self) -> tuple[str, ...]:
        """The camera's, in the order in which the arrays feed them; fewer than there are arrays."""
        return tuple(dict.fromkeys(name for light in self.options.lights for name in light.feeds))

    def exposures(self) -> tuple[Exposure, ...]:
        """One exposure sees all four."""
        levels = dict.fromkeys((light.name for light in self.options.lights), 1.0)
        return (Exposure(levels, self.channels),)

    def _set(self, levels: Mapping[str, float]) -> None:
        """Nothing to switch."""

    def _open(self) -> None:
        """Nothing to open."""

    def _close(self) -> None:
        """Nothing to close."""
