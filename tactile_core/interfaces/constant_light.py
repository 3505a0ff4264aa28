"""``core.constant``: lights that are always on, so that one exposure is one observation."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import BaseModel, Field, field_validator, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import Exposure, Illumination, Light
from tactile_core.interfaces.light_options import LightOptions, refuse_same_names

GREY, COLOUR = 1, 3  # Number of channels of a grey and of a colour image


class ConstantLightOptions(LightOptions):
    """One of several lights that are on together."""

    feeds: tuple[str, ...] = Field(
        default=(),
        description="Channels that see the light. Default: the channel of the same name, else all.",
    )


class ConstantOptions(Options):
    """Channels and lights of the single exposure."""

    channels: tuple[str, ...] = Field(
        default=("red", "green", "blue"),
        description="Names of the image's channels: three for a colour image, one for grey.",
    )
    lights: tuple[ConstantLightOptions, ...] = Field(
        default=(), description="The lights, for the virtual sensor and for reports."
    )

    @field_validator("channels")
    @classmethod
    def _fit_one_image(cls, channels: tuple[str, ...]) -> tuple[str, ...]:
        if len(channels) not in (GREY, COLOUR) or len(set(channels)) < len(channels):
            raise ValueError("should name 1 channel (grey) or 3 different channels (colour)")
        return channels

    @model_validator(mode="after")
    def _lights_differ(self) -> Self:
        refuse_same_names(self.lights)
        return self

    @model_validator(mode="after")
    def _feed_these_channels(self) -> Self:
        for light in self.lights:
            unknown = sorted(set(light.feeds) - set(self.channels))
            if unknown:
                raise ValueError(
                    f"light {light.name!r} feeds {unknown[0]!r}, which is not one of the channels "
                    f"{', '.join(self.channels)}"
                )
        if self.lights and all(light.feeds for light in self.lights):
            fed = {name for light in self.lights for name in light.feeds}
            dark = [name for name in self.channels if name not in fed]
            if dark:
                raise ValueError(f"no light feeds {', '.join(dark)}")
        return self


class ConstantIllumination(Illumination):
    """All lights are on all the time and share the image's channels."""

    Options: ClassVar[type[BaseModel]] = ConstantOptions
    options: Any

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights, in the order of the profile."""
        return tuple(light.make_light(light.feeds) for light in self.options.lights)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the image's channels."""
        return tuple(self.options.channels)

    def exposures(self) -> tuple[Exposure, ...]:
        """Return one exposure, with every light on."""
        names = [light.name for light in self.options.lights] or self.channels
        return (Exposure(dict.fromkeys(names, 1.0), self.channels),)
