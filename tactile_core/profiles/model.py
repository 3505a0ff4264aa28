"""What a profile may say: one sensor build, part by part.

Stage one of validation: these models need no plugin. A component's own options are checked by the
component's ``Options`` in stage two.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    model_validator,
)

Point = tuple[float, float]
Quad = tuple[Point, Point, Point, Point]
Point3 = tuple[float, float, float]


class Section(BaseModel):
    """A mapping whose unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Warp(Section):
    """Perspective: four points of the source image and where they go."""

    source: Quad = Field(description="Four corners [x, y] in the image before the warp, in px.")
    target: Quad = Field(description="Where they go in the width_px × height_px image, in px.")


class Lens(Section):
    """Pinhole camera with radial and tangential distortion, as OpenCV's calibration gives it."""

    matrix: tuple[Point3, Point3, Point3] = Field(description="Camera matrix, 3 × 3, in px.")
    distortion: list[float] = Field(
        min_length=4, max_length=14, description="k1, k2, p1, p2[, k3 …]."
    )


class ImageSection(Section):
    """From the camera's pixels to the image in which everything is measured.

    Order: crop, flip, rotate, lens, warp, else a resize if the sizes differ.
    """

    width_px: PositiveInt = Field(description="Width of the resulting image.")
    height_px: PositiveInt = Field(description="Height of the resulting image.")
    mm_per_px: PositiveFloat = Field(description="Scale of the resulting image on the gel.")
    crop: tuple[NonNegativeInt, NonNegativeInt, PositiveInt, PositiveInt] | None = Field(
        default=None, description="[x, y, width, height] in the camera's pixels."
    )
    flip: Literal["none", "horizontal", "vertical", "both"] = Field(
        default="none", description="Mirror the image."
    )
    rotate_deg: Literal[0, 90, 180, 270] = Field(default=0, description="Turn the image clockwise.")
    lens: Lens | None = Field(default=None, description="Undistort.")
    warp: Warp | None = Field(default=None, description="Perspective correction.")
    color: Literal["rgb", "grey"] = Field(
        default="rgb", description="What one exposure shows: colour or one intensity."
    )
    transfer: Literal["gamma", "linear"] = Field(
        default="gamma", description="Whether intensities are gamma-coded or linear in light."
    )
    bit_depth: Literal[8, 10, 12, 14, 16] = Field(
        default=8, description="Bits per intensity as the camera delivers them."
    )

    @property
    def full_scale(self) -> float:
        """The largest intensity."""
        return float(2**self.bit_depth - 1)


class Markers(Section):
    """Marks printed on the membrane."""

    pitch_mm: PositiveFloat = Field(description="Distance of neighbouring marks.")
    diameter_mm: PositiveFloat = Field(description="Size of one mark.")


class Gel(Section):
    """The elastomer; what is not known may be left out until a step needs it."""

    shape: Literal["flat", "dome"] = Field(default="flat", description="Shape at rest.")
    radius_mm: PositiveFloat | None = Field(default=None, description="Radius of a dome.")
    thickness_mm: PositiveFloat | None = Field(default=None, description="Thickness of the gel.")
    shear_modulus_mpa: PositiveFloat | None = Field(
        default=None, description="Neo-Hookean coefficient µ."
    )
    poisson_ratio: Annotated[float, Field(gt=0, lt=0.5)] | None = Field(
        default=None, description="Below 0.5; silicone is close to it."
    )
    friction: NonNegativeFloat | None = Field(default=None, description="Coulomb coefficient.")
    coating: Literal["matte", "semi_specular"] = Field(
        default="matte", description="How the skin reflects."
    )
    markers: Markers | Literal["auto"] | None = Field(
        default=None, description="Printed marks; auto finds pitch and size, null means none."
    )

    @model_validator(mode="after")
    def _dome_has_radius(self) -> Self:
        if self.shape == "dome" and self.radius_mm is None:
            raise ValueError("a dome needs radius_mm")
        return self


class Component(BaseModel):
    """A part that a plugin provides: ``use: plugin.name`` and that part's own options."""

    model_config = ConfigDict(extra="allow", frozen=True)

    use: str = Field(
        pattern=r"^[A-Za-z_][A-Za-z0-9_-]*\.[A-Za-z_][A-Za-z0-9_]*$",
        description="The component's name, plugin.name.",
    )

    @property
    def options(self) -> dict[str, Any]:
        """The keys beside ``use``; the component's own ``Options`` check them."""
        return dict(self.model_extra or {})


class Profile(Section):
    """One sensor build."""

    schema_version: Literal[1] = Field(alias="schema", description="Format of this file: 1.")
    name: str = Field(pattern=r"^[A-Za-z0-9_.-]+$", description="The profile's name.")
    revision: str = Field(default="", description="Which revision of the build.")
    description: str = Field(default="", description="One sentence for people.")
    image: ImageSection
    gel: Gel = Field(default_factory=Gel)
    camera: Component = Field(default_factory=lambda: Component(use="core.replay"))
    illumination: Component = Field(default_factory=lambda: Component(use="core.constant"))
    calibration: Component = Field(default_factory=lambda: Component(use="core.automatic"))
    estimators: dict[str, Component] = Field(
        default_factory=dict, description="The steps after the calibration, in order."
    )
    sim: dict[str, Any] = Field(
        default_factory=dict, description="Overlay of this profile for its virtual twin."
    )
