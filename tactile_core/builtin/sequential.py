"""``core.sequential``: lights fired one after another, with one exposure each."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import BaseModel, Field, PositiveFloat, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import (
    Exposure,
    Illumination,
    Light,
    LightOptions,
    refuse_same_names,
)

FEWEST_LIGHTS = 3  # The normal and the albedo have three unknowns (Woodham 1980)


class SequentialLight(LightOptions):
    """A light, and how it is exposed."""

    level: float = Field(default=1.0, gt=0, le=1, description="Brightness; 1 is full.")
    exposure_time_s: PositiveFloat | None = Field(
        default=None,
        description="Exposure time of this light, s, if the camera can change it between images. "
        "Default: that of the camera.",
    )


class SequentialOptions(Options):
    """Options of ``core.sequential``."""

    lights: tuple[SequentialLight, ...] = Field(
        min_length=FEWEST_LIGHTS, description="The lights in the order in which they fire."
    )

    dark: bool = Field(
        default=False,
        description="Take one more exposure without light and subtract it from the others.",
    )

    @model_validator(mode="after")
    def _lights_differ(self) -> Self:
        refuse_same_names(self.lights)
        return self


class SequentialIllumination(Illumination):
    """Fires one light per exposure, whose channel has the name of the light.

    With ``dark``, a last exposure without any light measures the ambient light.

    References
    ----------
    .. [1] R. J. Woodham, "Photometric method for determining surface orientation from multiple
       images", Optical Engineering 19(1), 1980.
    """

    Options: ClassVar[type[BaseModel]] = SequentialOptions

    def __init__(self, options: SequentialOptions) -> None:
        super().__init__(options)
        self._lights = tuple(light.make_light() for light in options.lights)
        self._exposed = options.lights
        self._dark = options.dark

    @property
    def lights(self) -> tuple[Light, ...]:
        """The lights, in the order in which they fire."""
        return self._lights

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the lights."""
        return tuple(light.name for light in self._lights)

    def exposures(self) -> tuple[Exposure, ...]:
        """One exposure per light, and a dark one at the end if requested."""
        lit = tuple(
            Exposure({light.name: light.level}, (light.name,), light.exposure_time_s)
            for light in self._exposed
        )
        return (*lit, Exposure({}, ())) if self._dark else lit
