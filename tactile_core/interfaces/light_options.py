"""Profile options of a single light, shared by the built-in illuminations."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from tactile_core.interfaces.illumination import Light
from tactile_core.interfaces.optics import LightBuild


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
