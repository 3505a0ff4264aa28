"""The profile's ``optics`` section: light, coating and camera of the virtual sensor.

Only the virtual sensor reads this section; measurements never depend on it. Every key is optional
and its default gives a plausible sensor.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt

from tactile_core.interfaces.artefact import Section

Leds = Annotated[PositiveInt, Field(le=100)]
Share = Annotated[float, Field(ge=0, le=1)]


class LightBuild(Section):
    """LED array behind each light of ``illumination.lights``; a light may override each key."""

    distance_mm: PositiveFloat | None = Field(
        default=None,
        description="Distance from the image centre to the LED array, mm. Default: 0.8 of the "
        "view's diagonal.",
    )
    array: tuple[Leds, Leds] = Field(
        default=(1, 1),
        description="Number of LEDs in the array: rows (away from the gel) and columns (along it).",
    )
    pitch_mm: PositiveFloat = Field(
        default=2.0, description="Spacing of adjacent LEDs in the array, mm."
    )
    lobe_deg: Annotated[float, Field(gt=0, lt=180)] = Field(
        default=120.0, description="Full angle at which an LED emits half its peak intensity."
    )
    aim_mm: float = Field(
        default=0.0,
        description="Distance past the image centre at which the array's axis meets the gel "
        "surface, mm.",
    )
    scatter: Share = Field(
        default=0.0, description="Share of the light that a diffuser spreads evenly, 0 to 1."
    )
    spread: Share = Field(
        default=0.0,
        description="Relative standard deviation of the brightness between lights, 0 to 1.",
    )


class Coat(Section):
    """Reflectance of the gel surface; keys left out follow from ``gel.coating``."""

    specular: Share | None = Field(
        default=None, description="Specular share of the reflected light, 0 to 1."
    )
    roughness: PositiveFloat | None = Field(
        default=None,
        description="Roughness of the specular part: root-mean-square slope of its facets over √2.",
    )
    grain: NonNegativeFloat = Field(
        default=0.015,
        description="Relative standard deviation of the reflectance (surface grain).",
    )
    grain_mm: PositiveFloat | None = Field(
        default=None, le=10, description="Correlation length of the grain, mm. Default: one pixel."
    )
    absorption_per_mm: NonNegativeFloat = Field(
        default=0.0,
        description="Light that the gel surface loses per mm of indentation: exp(−absorption · "
        "height) remains. 0 for an opaque coating; sensors that measure darkness have about 1.",
    )
    ink: Share = Field(
        default=0.06,
        description="Reflectance of a printed marker relative to the bare gel surface, 0 to 1.",
    )


class Print(Section):
    """Appearance of the markers in ``gel.markers``."""

    shape: Literal["round", "square", "triangle"] = Field(
        default="round", description="Outline of a marker."
    )
    layout: Literal["grid", "quasi_random"] = Field(
        default="grid",
        description="Marker layout: a square grid, or the grid with random offsets and rotations.",
    )
    shift_mm: tuple[float, float] = Field(
        default=(0.0, 0.0), description="Position of the grid relative to the image centre, mm."
    )
    angle_deg: float = Field(
        default=0.0, description="Rotation of the grid, positive from x towards y."
    )
    jitter_mm: NonNegativeFloat = Field(
        default=0.0, description="Standard deviation of each marker's position, mm."
    )


class ImageSensor(Section):
    """How the camera converts light to pixel values."""

    exposure: Annotated[float, Field(gt=0, lt=1)] = Field(
        default=0.4,
        description="Mean pixel value of the undeformed gel surface, as a share of full scale.",
    )
    white_balance: tuple[PositiveFloat, PositiveFloat, PositiveFloat] = Field(
        default=(1.0, 1.0, 1.0),
        description="Gain of red, green and blue relative to a balanced camera's.",
    )
    crosstalk: Annotated[float, Field(ge=0, le=0.5)] = Field(
        default=0.08, description="Share of a colour's light that leaks into the adjacent channel."
    )
    vignetting: Share = Field(
        default=0.2, description="Share of the light lost in the image corners, 0 to 1."
    )
    view_distance_mm: PositiveFloat | None = Field(
        default=None,
        description="Distance from the gel surface to the camera's pupil, mm. Default: 1.5 "
        "diagonals of the view.",
    )
    full_well_e: PositiveFloat = Field(
        default=8000.0,
        description="Electrons at full scale; photon shot noise is the square root of the signal.",
    )
    read_noise_e: NonNegativeFloat = Field(default=8.0, description="Read noise, electrons.")
    gamma: PositiveFloat = Field(
        default=2.2, description="Gamma of the pixel values where image.transfer is gamma."
    )
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] | Literal["none"] | None = Field(
        default=None,
        description="JPEG quality of a camera that compresses its frames. Default: 90 for 8-bit "
        "colour images with gamma, none otherwise.",
    )


class Optics(Section):
    """Light, gel surface and camera of the virtual sensor."""

    lights: LightBuild = Field(default_factory=LightBuild, description="LED arrays of the lights.")
    ambient: Share = Field(
        default=0.15,
        description="Ambient share of the light on the undeformed gel surface, 0 to 1.",
    )
    coat: Coat = Field(default_factory=Coat, description="Reflectance of the gel surface.")
    markers: Print = Field(default_factory=Print, description="Appearance of printed markers.")
    sensor: ImageSensor = Field(default_factory=ImageSensor, description="Camera sensor.")
