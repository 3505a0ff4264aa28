"""Illumination by three LED arrays (red, green, blue) on alternate sides of a hexagon.

References
----------
.. [1] S. Dong, W. Yuan and E. H. Adelson, "Improved GelSight Tactile Sensor for Measuring Geometry
   and Slip", IROS, 2017.
.. [2] W. Yuan, S. Dong and E. H. Adelson, "GelSight: High-Resolution Robot Tactile Sensors for
   Estimating Geometry and Force", Sensors 17(12), 2017, section 4.2.
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel, Field, model_validator

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.illumination import ConstantIllumination, ConstantLightOptions

# Tilt of the LED arrays relative to the gel surface, in degrees; Yuan et al. 2017, section 4.2.
ARRAY_TILT_DEG = 71.0


class ColourArray(ConstantLightOptions):
    """One 2 × 4 array of LEDs of one colour, whose lenses limit the light to 30°."""

    name: str = Field(
        min_length=1, description="Colour of the array; also the name of its channel."
    )
    elevation_deg: float = Field(
        default=90 - ARRAY_TILT_DEG,
        gt=0,
        lt=90,
        description="Elevation of the light above the gel surface, degrees.",
    )


class TricolourOptions(Options):
    """Options of ``hex_fingertip.tricolour``."""

    lights: tuple[ColourArray, ColourArray, ColourArray] = Field(
        default=(
            ColourArray(name="red", azimuth_deg=90),
            ColourArray(name="green", azimuth_deg=210),
            ColourArray(name="blue", azimuth_deg=330),
        ),
        description="The LED arrays, in the order of the camera's channels.",
    )

    @model_validator(mode="after")
    def _names_differ(self) -> TricolourOptions:
        names = [light.name for light in self.lights]
        if len(set(names)) < 3:
            raise ValueError("three arrays need three different names")
        return self


class Tricolour(ConstantIllumination):
    """Three LED arrays without a driver: they are lit together whenever the sensor has power."""

    Options: ClassVar[type[BaseModel]] = TricolourOptions
    options: TricolourOptions

    @property
    def channels(self) -> tuple[str, ...]:
        """The colours, in the order of the camera's channels."""
        return tuple(light.name for light in self.options.lights)
