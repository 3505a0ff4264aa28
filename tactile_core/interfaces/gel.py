"""The profile's ``gel`` section: shape, elastomer, coating and markers of one sensor build."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationInfo, field_validator

from tactile_core.interfaces.artefact import Section
from tactile_core.interfaces.image import ImageSection

_MIN_PITCH_PX = 2.0  # Smallest marker pitch that an image resolves, px: the Nyquist limit
_MIN_DIAMETER_PX = 0.5  # Smallest marker diameter that is visible, px; chosen by hand
_MAX_PRONY_TERMS = 20


class Markers(Section):
    """Markers printed on the gel surface."""

    pitch_mm: PositiveFloat = Field(description="Distance between adjacent marker centres, mm.")
    diameter_mm: PositiveFloat = Field(description="Diameter of a marker, mm.")

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
        max_length=_MAX_PRONY_TERMS,
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
        description="Printed markers; auto measures pitch and diameter, null means none.",
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
    if _MIN_PITCH_PX <= pitch_px <= widest_px and diameter_px >= _MIN_DIAMETER_PX:
        return None
    return (
        f"has markers of {diameter_px:.3g} px every {pitch_px:.3g} px in an image of "
        f"{image.width_px} × {image.height_px}; correct gel.markers or image.mm_per_px"
    )
