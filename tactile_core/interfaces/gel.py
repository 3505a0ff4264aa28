"""Gel and optics of a sensor, as profiles describe them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationInfo,
    field_validator,
)

from tactile_core.interfaces.artefact import Section
from tactile_core.interfaces.image import ImageSection


class Markers(Section):
    """Markers printed on the gel surface."""

    pitch_mm: PositiveFloat = Field(description="Distance between adjacent marker centres, mm.")
    diameter_mm: PositiveFloat = Field(description="Diameter of a marker, mm.")
    tone: Literal["dark", "bright"] = Field(
        default="dark",
        description="Whether markers (dots, rings, pins) are darker or brighter than the gel.",
    )
    count: PositiveInt | None = Field(
        default=None,
        description="Number of markers in view; null: as many as fill the image at that pitch.",
    )

    @field_validator("diameter_mm")
    @classmethod
    def _markers_do_not_touch(cls, diameter_mm: float, info: ValidationInfo) -> float:
        pitch_mm = info.data.get("pitch_mm")
        if pitch_mm is not None and diameter_mm >= pitch_mm:
            raise ValueError(
                f"should be smaller than pitch_mm, not {diameter_mm:g}: markers must not touch"
            )
        return diameter_mm


class Relaxation(Section):
    """One term of the Prony series of stress relaxation: a spring in series with a dashpot."""

    modulus_share: PositiveFloat = Field(
        description="Instantaneous extra stiffness, as a share of shear_modulus_mpa."
    )
    time_s: PositiveFloat = Field(description="Relaxation time constant (decay to 1/e), s.")


class Gel(Section):
    """Shape and material of the gel; leave out unknown values until a step needs them."""

    shape: Literal["flat", "dome"] = Field(
        default="flat", description="Shape of the undeformed gel surface."
    )
    radius_mm: PositiveFloat | None = Field(
        default=None, validate_default=True, description="Radius of a dome, mm."
    )
    thickness_mm: PositiveFloat | None = Field(
        default=None, description="Thickness of the gel, mm."
    )
    shear_modulus_mpa: PositiveFloat | None = Field(
        default=None, description="Neo-Hookean coefficient µ, MPa."
    )
    poisson_ratio: Annotated[float, Field(gt=0, lt=0.5)] | None = Field(
        default=None, description="Poisson ratio, below 0.5; silicone is close to 0.5."
    )
    friction: NonNegativeFloat | None = Field(
        default=None, description="Coulomb friction coefficient."
    )
    kinetic_friction: NonNegativeFloat | None = Field(
        default=None,
        validate_default=True,
        description="Friction coefficient where the contact slips; null: the same as friction.",
    )
    friction_speed_mm_s: PositiveFloat | None = Field(
        default=None,
        description="Slip speed at which friction doubles, mm/s; null: independent of speed.",
    )
    prony: list[Relaxation] | None = Field(
        default=None,
        max_length=20,
        description="Prony series of stress relaxation; shear_modulus_mpa is the relaxed value.",
    )
    size_mm: tuple[PositiveFloat, PositiveFloat] | None = Field(
        default=None,
        description="Width and height of the gel, mm; null: larger than the field of view.",
    )
    crown_mm: NonNegativeFloat | None = Field(
        default=None,
        description="Height of the middle above the edges, in addition to the shape, mm; needs "
        "size_mm.",
    )
    coating: Literal["matte", "semi_specular"] = Field(
        default="matte", description="Reflectance of the gel surface."
    )
    markers: Markers | Literal["auto"] | None = Field(
        default=None,
        description="Printed markers; auto measures tone, pitch and diameter, null means none.",
    )

    @field_validator("radius_mm")
    @classmethod
    def _dome_alone_has_radius(cls, radius_mm: float | None, info: ValidationInfo) -> float | None:
        shape = info.data.get("shape")
        if shape == "dome" and radius_mm is None:
            raise ValueError("is missing, and a dome needs it; add it")
        if shape == "flat" and radius_mm is not None:
            raise ValueError("belongs to 'shape: dome'; remove it or add that")
        return radius_mm

    @field_validator("kinetic_friction")
    @classmethod
    def _slip_adds_no_friction(cls, kinetic: float | None, info: ValidationInfo) -> float | None:
        friction = info.data.get("friction")
        if kinetic is not None and (friction is None or kinetic > friction):
            raise ValueError("should be no more than friction, which it needs beside it")
        return kinetic

    @field_validator("crown_mm")
    @classmethod
    def _crown_needs_edges(cls, crown_mm: float | None, info: ValidationInfo) -> float | None:
        if crown_mm and info.data.get("size_mm") is None:
            raise ValueError("is the height of the middle above the edges; add size_mm")
        return crown_mm


def markers_misfit(gel: Gel, image: ImageSection) -> str | None:
    """Return why the image cannot resolve the gel's markers, or None if it can."""
    if not isinstance(gel.markers, Markers):
        return None
    pitch_px = gel.markers.pitch_mm / image.mm_per_px
    diameter_px = gel.markers.diameter_mm / image.mm_per_px
    widest_px = image.width_px + image.height_px
    # a pitch below 2 px is beyond the Nyquist limit, a dot below 0.5 px invisible
    if 2.0 <= pitch_px <= widest_px and diameter_px >= 0.5:
        return None
    return (
        f"has markers of {diameter_px:.3g} px every {pitch_px:.3g} px in an image of "
        f"{image.width_px} × {image.height_px}; correct gel.markers or image.mm_per_px"
    )


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
    scatters: Literal["surface", "volume"] = Field(
        default="surface",
        description="Where light turns back to the camera. From the volume of a translucent gel it "
        "depends on the height alone, by absorption_per_mm, and no slope shades it.",
    )
    ink: Annotated[float, Field(ge=0, le=100)] | None = Field(
        default=None,
        description="Reflectance of a printed marker relative to the bare gel surface. Default: "
        "0.06, and 2 for bright markers.",
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
