"""Three arrays of LEDs, red, green and blue, on every other side of a hexagon."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, Field, model_validator

from tactile_core.interfaces.constant_light import ConstantIllumination, ConstantLightOptions
from tactile_core.interfaces.device import Options

ARRAY_TILT_DEG = 71.0
"""Tilt of the arrays to the gel (review, section 4.2)."""


class ColourArray(ConstantLightOptions):
    """One 2 × 4 array of LEDs of one colour, which shine within 30° each."""

    name: str = Field(
        min_length=1, description="The colour, which is also the channel that sees it."
    )
    elevation_deg: float = Field(
        default=90 - ARRAY_TILT_DEG,
        gt=0,
        lt=90,
        description="Its angle above the gel surface.",
    )


class TricolourOptions(Options):
    """Options of ``hex_fingertip.tricolour``."""

    lights: tuple[ColourArray, ColourArray, ColourArray] = Field(
        default=(
            ColourArray(name="red", azimuth_deg=90),
            ColourArray(name="green", azimuth_deg=210),
            ColourArray(name="blue", azimuth_deg=330),
        ),
        description="The arrays, in the order of the camera's channels.",
    )

    @model_validator(mode="after")
    def _names_differ(self) -> TricolourOptions:
        names = [light.name for light in self.lights]
        if len(set(names)) < 3:
            raise ValueError("three arrays need three different names")
        return self


class Tricolour(ConstantIllumination):
    """The arrays are wired to the supply: they shine together whenever the sensor is plugged in."""

    Options: ClassVar[type[BaseModel]] = TricolourOptions
    options: TricolourOptions

    @property
    def channels(self) -> tuple[str, ...]:
        """The colours, in the order of the camera's channels."""
        return tuple(light.name for light in self.options.lights)
