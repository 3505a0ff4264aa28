"""The gel of one sensor build: its shape, its elastomer, its coating and its markers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationInfo, field_validator

from tactile_core.interfaces.image import ImageSection
from tactile_core.interfaces.section import Section

_DENSEST_PX = 2.0
"""Pitch of markers that can still be distinguished."""
_SMALLEST_PX = 0.5
"""Diameter of a marker that can still be seen."""
_MOST_TERMS = 20


class Markers(Section):
    """Markers printed on the membrane."""

    pitch_mm: PositiveFloat = Field(description="Distance of neighbouring markers.")
    diameter_mm: PositiveFloat = Field(description="Size of one marker.")

    @field_validator("diameter_mm")
    @classmethod
    def _markers_lie_apart(cls, diameter_mm: float, info: ValidationInfo) -> float:
        pitch_mm = info.data.get("pitch_mm")
        if pitch_mm is not None and diameter_mm >= pitch_mm:
            raise ValueError(
                f"should be smaller than pitch_mm, not {diameter_mm:g}: markers must not touch"
            )
        return diameter_mm


class Relaxation(Section):
    """One way in which the gel's stress fades: a spring in series with a dashpot."""

    modulus_share: PositiveFloat = Field(
        description="Extra stiffness at once, as a share of shear_modulus_mpa."
    )
    time_s: PositiveFloat = Field(description="Time in which it falls to 1/e.")


class Gel(Section):
    """The elastomer; what is not known may be left out until a step needs it."""

    shape: Literal["flat", "dome"] = Field(default="flat", description="Shape at rest.")
    radius_mm: PositiveFloat | None = Field(
        default=None, validate_default=True, description="Radius of a dome."
    )
    thickness_mm: PositiveFloat | None = Field(default=None, description="Thickness of the gel.")
    shear_modulus_mpa: PositiveFloat | None = Field(
        default=None, description="Neo-Hookean coefficient µ."
    )
    poisson_ratio: Annotated[float, Field(gt=0, lt=0.5)] | None = Field(
        default=None, description="Below 0.5; silicone is close to it."
    )
    friction: NonNegativeFloat | None = Field(default=None, description="Coulomb coefficient.")
    friction_speed_mm_s: PositiveFloat | None = Field(
        default=None,
        description="Speed of slip at which friction has doubled; null: the same at every speed.",
    )
    prony: list[Relaxation] | None = Field(
        default=None,
        max_length=_MOST_TERMS,
        description="How stress relaxes towards shear_modulus_mpa, its value in the end.",
    )
    size_mm: tuple[PositiveFloat, PositiveFloat] | None = Field(
        default=None, description="Width and height of the gel; null: beyond the view all around."
    )
    crown_mm: NonNegativeFloat | None = Field(
        default=None,
        description="How much lower the edges are than the middle, beside the shape; with size_mm.",
    )
    coating: Literal["matte", "semi_specular"] = Field(
        default="matte", description="How the skin reflects."
    )
    markers: Markers | Literal["auto"] | None = Field(
        default=None, description="Printed markers; auto finds pitch and size, null means none."
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

    @field_validator("crown_mm")
    @classmethod
    def _crown_needs_edges(cls, crown_mm: float | None, info: ValidationInfo) -> float | None:
        if crown_mm and info.data.get("size_mm") is None:
            raise ValueError("tells how low the edges are, and needs size_mm; add it")
        return crown_mm


def markers_misfit(gel: Gel, image: ImageSection) -> str | None:
    """Say why an image cannot show the gel's markers; None where it can."""
    if not isinstance(gel.markers, Markers):
        return None
    pitch_px = gel.markers.pitch_mm / image.mm_per_px
    diameter_px = gel.markers.diameter_mm / image.mm_per_px
    widest_px = image.width_px + image.height_px
    if _DENSEST_PX <= pitch_px <= widest_px and diameter_px >= _SMALLEST_PX:
        return None
    return (
        f"has markers of {diameter_px:.3g} px every {pitch_px:.3g} px in an image of "
        f"{image.width_px} × {image.height_px}; correct gel.markers or image.mm_per_px"
    )
