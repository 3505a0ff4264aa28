"""``core.constant``: lights that always shine, so that one exposure is one observation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import BaseModel, Field, field_validator, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination

GREY, COLOUR = 1, 3


class LightOptions(Options):
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
    lights: tuple[LightOptions, ...] = Field(
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
        refuse_same_names(self.lights)
        return self


def refuse_same_names(lights: Sequence[LightOptions]) -> None:
    """Raise a ValueError if two lights have one name."""
    if len({light.name for light in lights}) < len(lights):
        raise ValueError("two lights have one name")


class ConstantIllumination(Illumination):
    """All lights shine all the time; there is nothing to switch.

    Rigs whose lights are wired to the supply give options of their own, with ``lights``, and say
    which ``channels`` they make.
    """

    Options: ClassVar[type[BaseModel]] = ConstantOptions
    options: Any

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the image's channels."""
        return tuple(self.options.channels)

    def exposures(self) -> tuple[Exposure, ...]:
        """One, with every light on."""
        names = [light.name for light in self.options.lights] or self.channels
        return (Exposure(dict.fromkeys(names, 1.0), self.channels),)

    def _open(self) -> None:
        """Nothing to acquire."""

    def _close(self) -> None:
        """Nothing to release."""

    def _set(self, levels: Mapping[str, float]) -> None:
        """Nothing to switch."""
