"""Four arrays of LEDs, one on each side, whose light shares three channels."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, Field, model_validator

from tactile_core.builtin.constant_light import ConstantIllumination
from tactile_core.interfaces.device import Options

CHANNELS = ("red", "green", "blue")


class SideArray(Options):
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
    def _feeds_the_camera(self) -> SideArray:
        unknown = sorted(set(self.feeds) - set(CHANNELS))
        if unknown or len(set(self.feeds)) < len(self.feeds):
            raise ValueError(f"feeds some of {', '.join(CHANNELS)}, each once")
        return self


class FourSidesOptions(Options):
    """Options of ``baxter_fingertip.four_sides``."""

    lights: tuple[SideArray, SideArray, SideArray, SideArray] = Field(
        default=(
            SideArray(name="red", azimuth_deg=-90, feeds=("red",)),
            SideArray(name="green", azimuth_deg=0, feeds=("green",)),
            SideArray(name="blue", azimuth_deg=90, feeds=("blue",)),
            SideArray(name="white", azimuth_deg=180, feeds=CHANNELS),
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


class FourSides(ConstantIllumination):
    """The arrays are wired to the supply: they shine together whenever the sensor is plugged in."""

    Options: ClassVar[type[BaseModel]] = FourSidesOptions
    options: FourSidesOptions

    @property
    def channels(self) -> tuple[str, ...]:
        """The camera's, in the order in which the arrays feed them; fewer than there are arrays."""
        return tuple(dict.fromkeys(name for light in self.options.lights for name in light.feeds))
