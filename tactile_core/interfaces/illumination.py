"""The illumination interface: the lights' positions, and which are on in each exposure.

An illumination only describes; a :class:`~tactile_core.interfaces.light_driver.LightDriver`
switches real lights. ``core.constant``, lights that are always on, is every profile's default.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Self

from pydantic import BaseModel, Field, field_validator, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.gel import LightBuild

Color = Literal["red", "green", "blue"]
COLORS: tuple[Color, ...] = ("red", "green", "blue")  # Of a colour image, in the order of RGB


@dataclass(frozen=True)
class Light:
    """One light, as seen from the image centre.

    Attributes
    ----------
    name : str
    azimuth_deg : float
        Direction from the image centre, from x towards y: 0 is right, 90 is down.
    elevation_deg : float
        Angle above the gel surface; 90 is perpendicular to it.
    feeds : tuple of str
        Channels that see the light, if several lights share an exposure. Empty: the channel of
        the same name or, if there is none, all channels.
    build : LightBuild
        Construction of this light in the virtual sensor; keys that it sets override the
        profile's ``optics.lights``.
    """

    name: str
    azimuth_deg: float
    elevation_deg: float
    feeds: tuple[str, ...] = ()
    build: LightBuild = field(default_factory=LightBuild)


@dataclass(frozen=True)
class Exposure:
    """One exposure of an observation.

    Attributes
    ----------
    levels : mapping of light to level
        Brightness 0..1 of each light that is on.
    channels : tuple of str
        The light channels that this exposure measures; empty for a dark exposure.
    exposure_time_s : float or None
        Exposure time, if it differs from the camera's setting.
    gain : float or None
        Gain in the camera's own unit, if it differs from the camera's setting.
    color : "red", "green", "blue" or None
        The colour of a colour camera's image that is the exposure's one channel. None: the whole
        image.
    """

    levels: Mapping[str, float]
    channels: tuple[str, ...]
    exposure_time_s: float | None = None
    gain: float | None = None
    color: Color | None = None


class Illumination(ABC):
    """The lighting of one photometric observation.

    Implement ``channels`` and ``exposures``, and ``lights`` if the positions are known. All three
    depend on the options alone and never change.
    """

    Options: ClassVar[type[BaseModel]] = Options

    def __init__(self, options: BaseModel) -> None:
        self.options = options

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights and their positions; empty if the profile does not give them."""
        return ()

    @property
    @abstractmethod
    def channels(self) -> tuple[str, ...]:
        """Names of the K light channels of a frame, in order."""

    @abstractmethod
    def exposures(self) -> tuple[Exposure, ...]:
        """Return the exposures that make up one observation, in order."""


class LightOptions(LightBuild):
    """Direction of one light, and any keys of its LED array that differ from ``optics.lights``."""

    name: str = Field(min_length=1, description="The light's name.")
    azimuth_deg: float = Field(
        description="Direction of the light around the image centre: 0 is right, 90 is down."
    )
    elevation_deg: float = Field(
        ge=0, le=90, description="Angle of the light above the gel surface; 90 is perpendicular."
    )

    def make_light(self, feeds: tuple[str, ...] = ()) -> Light:
        """Return the light that these options describe."""
        own = self.model_dump(include=set(LightBuild.model_fields), exclude_unset=True)
        return Light(
            self.name, self.azimuth_deg, self.elevation_deg, feeds, LightBuild.model_validate(own)
        )


def refuse_same_names(lights: Sequence[LightOptions]) -> None:
    """Raise a ValueError if two lights share a name."""
    if len({light.name for light in lights}) < len(lights):
        raise ValueError("two lights have the same name")


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
