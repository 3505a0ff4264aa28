"""Three arrays of LEDs, red, green and blue, on every other side of a hexagon."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pydantic import BaseModel, Field, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination

ARRAY_TILT_DEG = 71.0
"""Tilt of the arrays to the gel (review, section 4.2)."""


class Array(Options):
    """One 2 × 4 array of LEDs of one colour, which shine within 30° each."""

    name: str = Field(
        min_length=1, description="The colour, which is also the channel that sees it."
    )
    azimuth_deg: float = Field(description="Where it stands, from x towards y.")
    elevation_deg: float = Field(
        default=90 - ARRAY_TILT_DEG, gt=0, lt=90, description="Angle of its light to the skin."
    )


class TricolourOptions(Options):
    """Options of ``hex_fingertip.tricolour``."""

    lights: tuple[Array, Array, Array] = Field(
        default=(
            Array(name="red", azimuth_deg=90),
            Array(name="green", azimuth_deg=210),
            Array(name="blue", azimuth_deg=330),
        ),
        description="The arrays, in the order of the camera's channels.",
    )

    @model_validator(mode="after")
    def _names_differ(self) -> TricolourOptions:
        names = [light.name for light in self.lights]
        if len(set(names)) < 3:
            raise ValueError("three arrays need three different names")
        return self


class Tricolour(Illumination):
    """The arrays are wired to the supply: they shine together whenever the sensor is plugged in."""

    Options: ClassVar[type[BaseModel]] = TricolourOptions
    options: TricolourOptions

    @property
    def channels(self) -> tuple[str, ...]:
        """The colours, in the order of the camera's channels."""
        return tuple(light.name for light in self.options.lights)

    def exposures(self) -> tuple[Exposure, ...]:
        """One exposure sees all three."""
        return (Exposure(dict.fromkeys(self.channels, 1.0), self.channels),)

    def _set(self, levels: Mapping[str, float]) -> None:
        """Nothing to switch."""

    def _open(self) -> None:
        """Nothing to open."""

    def _close(self) -> None:
        """Nothing to close."""
