"""What a profile may say about its light beyond where the lamps stand, for its virtual twin.

Nothing that measures reads this section; every key has a default that gives a plausible sensor.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from tactile_core.interfaces.section import Section

Leds = Annotated[PositiveInt, Field(le=100)]
Share = Annotated[float, Field(ge=0, le=1)]


class LightBuild(Section):
    """How each lamp of ``illumination.lights`` is built; a lamp may say the same keys itself."""

    distance_mm: PositiveFloat | None = Field(
        default=None,
        description="From the image centre to the lamp; four fifths of the view's diagonal if "
        "left out.",
    )
    array: tuple[Leds, Leds] = Field(
        default=(1, 1), description="LEDs of a lamp: rows up from the gel, columns along it."
    )
    pitch_mm: PositiveFloat = Field(default=2.0, description="Distance of neighbouring LEDs.")
    lobe_deg: Annotated[float, Field(gt=0, lt=180)] = Field(
        default=120.0, description="Full angle in which an LED shines at half strength or more."
    )
    aim_mm: float = Field(
        default=0.0, description="How far beyond the image centre the lamp's axis meets the skin."
    )
    scatter: Share = Field(
        default=0.0, description="Share of the light that a diffuser spreads evenly."
    )
    spread: Share = Field(
        default=0.0, description="Relative standard deviation of the brightness from lamp to lamp."
    )


class Coat(Section):
    """How the skin reflects; what is left out follows from ``gel.coating``."""

    specular: Share | None = Field(
        default=None, description="Share of the reflected light that flakes mirror."
    )
    roughness: PositiveFloat | None = Field(
        default=None, description="Spread of the flakes: root-mean-square slope over √2."
    )
    grain: NonNegativeFloat = Field(
        default=0.015, description="Relative standard deviation of the skin's brightness."
    )
    grain_mm: PositiveFloat | None = Field(
        default=None, le=10, description="Size of the grain; a pixel if left out."
    )
    ink: Share = Field(default=0.06, description="What a printed marker reflects, of the skin's.")


class Print(Section):
    """How the markers of ``gel.markers`` look."""

    shape: Literal["round", "square", "triangle"] = Field(
        default="round", description="Outline of one marker."
    )
    layout: Literal["grid", "quasi_random"] = Field(
        default="grid", description="Square grid, or places and turns by chance, evenly spread."
    )


class ImageSensor(Section):
    """How the camera turns light into numbers."""

    exposure: Annotated[float, Field(gt=0, lt=1)] = Field(
        default=0.4, description="Intensity of the resting skin, of full scale, as pictures say it."
    )
    crosstalk: Annotated[float, Field(ge=0, le=0.5)] = Field(
        default=0.08, description="Share of a colour that its neighbour in the spectrum sees."
    )
    vignetting: Share = Field(default=0.2, description="Share of the light that corners lose.")
    view_distance_mm: PositiveFloat | None = Field(
        default=None,
        description="From the skin to the pupil; one and a half diagonals of the view if left out.",
    )
    full_well_e: PositiveFloat = Field(
        default=8000.0, description="Electrons at full scale: light's own noise is their root."
    )
    read_noise_e: NonNegativeFloat = Field(default=8.0, description="Noise without any light.")
    gamma: PositiveFloat = Field(
        default=2.2, description="Exponent of the coding where image.transfer is gamma."
    )
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] | Literal["none"] | None = Field(
        default=None,
        description="Of a camera that sends JPEG; 90 for gamma-coded colour of 8 bits if left out.",
    )


class Optics(Section):
    """Light, skin and camera of the virtual twin."""

    lights: LightBuild = Field(default_factory=LightBuild, description="How the lamps are built.")
    ambient: Share = Field(
        default=0.15, description="Share of the resting skin's light that comes from everywhere."
    )
    coat: Coat = Field(default_factory=Coat, description="How the skin reflects.")
    markers: Print = Field(default_factory=Print, description="How printed markers look.")
    sensor: ImageSensor = Field(default_factory=ImageSensor, description="The camera's chip.")
