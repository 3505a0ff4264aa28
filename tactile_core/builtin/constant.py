"""``core.constant``: lights that always shine, so that one exposure is one observation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Self

from pydantic import BaseModel, Field, field_validator, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination

GREY, COLOUR = 1, 3


class Light(Options):
    """One lamp, as seen from the image centre."""

    name: str = Field(min_length=1, description="The lamp's name.")
    azimuth_deg: float = Field(
        description="Where it stands around the image: 0 is right, 90 is down."
    )
    elevation_deg: float = Field(
        ge=0, le=90, description="Its angle above the skin; 90 shines straight onto it."
    )


class ConstantOptions(Options):
    """What one exposure shows."""

    channels: tuple[str, ...] = Field(
        default=("red", "green", "blue"),
        description="Names of the image's channels: three of a colour image, one of a grey one.",
    )
    lights: tuple[Light, ...] = Field(
        default=(), description="The lamps, for the virtual twin and for reports."
    )

    @field_validator("channels")
    @classmethod
    def _fit_one_image(cls, channels: tuple[str, ...]) -> tuple[str, ...]:
        if len(channels) not in (GREY, COLOUR) or len(set(channels)) < len(channels):
            raise ValueError(
                "one exposure shows 1 (grey) or 3 (colour) channels, named differently"
            )
        return channels

    @model_validator(mode="after")
    def _lights_differ(self) -> Self:
        names = [light.name for light in self.lights]
        if len(set(names)) < len(names):
            raise ValueError("two lights have one name")
        return self


class ConstantIllumination(Illumination):
    """All lights shine all the time; there is nothing to switch."""

    Options: ClassVar[type[BaseModel]] = ConstantOptions

    def __init__(self, options: ConstantOptions) -> None:
        super().__init__(options)
        names = [light.name for light in options.lights] or list(options.channels)
        self._exposures = (Exposure(dict.fromkeys(names, 1.0), options.channels),)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the image's channels."""
        return self._exposures[0].channels

    def exposures(self) -> tuple[Exposure, ...]:
        """One, with every light on."""
        return self._exposures

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _set(self, levels: Mapping[str, float]) -> None:
        """Nothing to switch."""
