"""What a profile may say: one sensor build, part by part.

Stage one of validation: these models need no plugin. A component's own options are checked by the
component's ``Options`` in stage two.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import combinations
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    ValidationInfo,
    field_validator,
    model_validator,
)

from tactile_core.formats.headers import MOST_PIXELS
from tactile_core.formats.shown import shown
from tactile_core.profiles.optics import Optics
from tactile_core.profiles.section import Section

Point = tuple[float, float]
Quad = tuple[Point, Point, Point, Point]
Point3 = tuple[float, float, float]
Crop = tuple[NonNegativeInt, NonNegativeInt, PositiveInt, PositiveInt]

_NAME = r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}$"
_USE = r"^[A-Za-z_][A-Za-z0-9_-]*\.[A-Za-z_][A-Za-z0-9_]*$"
_MOST_PX = 32_766
"""OpenCV addresses pixels by 16 bits."""
_FINEST_MM = 1e-6
"""A pixel of a nanometre, a thousandth of what light can resolve."""
_WIDEST_MM = 1000.0
_DENSEST_PX = 2.0
"""Pitch of marks that can still be distinguished."""
_SMALLEST_PX = 0.5
"""Diameter of a mark that can still be seen."""
_MOST_TERMS = 20
_FLATTEST = 1e-3
"""Least area of a triangle of corners, over that of the box around them."""
_DISTORTIONS = (4, 5, 8, 12, 14)


def _named(text: str) -> str:
    if not re.fullmatch(_NAME, text):
        raise ValueError(
            f"should be up to 100 letters, digits, '_', '.' and '-', and not begin with '.' or "
            f"'-', not {shown(text)}"
        )
    return text


def _component_named(text: str) -> str:
    if not re.fullmatch(_USE, text):
        raise ValueError(f"should be plugin.name, for example 'core.poisson', not {shown(text)}")
    return text


class Warp(Section):
    """Perspective: four points of the source image and where they go."""

    source: Quad = Field(description="Four corners [x, y] in the image before the warp, in px.")
    target: Quad = Field(description="Where they go in the width_px × height_px image, in px.")

    @field_validator("source", "target")
    @classmethod
    def _four_corners(cls, quad: Quad) -> Quad:
        xs, ys = zip(*quad, strict=True)
        box = (max(xs) - min(xs)) * (max(ys) - min(ys))
        if min(map(abs, _turns(quad))) <= _FLATTEST * box:
            raise ValueError("three of the four corners lie on one line")
        return quad

    @field_validator("target")
    @classmethod
    def _same_order(cls, target: Quad, info: ValidationInfo) -> Quad:
        turns = zip(_turns(info.data.get("source", target)), _turns(target), strict=True)
        if len({before * after > 0 for before, after in turns}) > 1:
            raise ValueError("lists the corners in another order than source")
        return target


def _turns(quad: Quad) -> list[float]:
    """Twice the signed area of each triangle of corners; positive where it turns x towards y."""
    return [
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        for (ax, ay), (bx, by), (cx, cy) in combinations(quad, 3)
    ]


class Lens(Section):
    """Pinhole camera with radial and tangential distortion, as OpenCV's calibration gives it."""

    matrix: tuple[Point3, Point3, Point3] = Field(description="Camera matrix, 3 × 3, in px.")
    distortion: list[float] = Field(
        min_length=4, max_length=14, description="k1, k2, p1, p2[, k3 …]."
    )

    @field_validator("matrix")
    @classmethod
    def _is_a_camera_matrix(
        cls, matrix: tuple[Point3, Point3, Point3]
    ) -> tuple[Point3, Point3, Point3]:
        (fx, _, _), (below, fy, _), last = matrix
        if fx <= 0 or fy <= 0 or below != 0 or last != (0, 0, 1):
            raise ValueError("should be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy > 0")
        return matrix

    @field_validator("distortion")
    @classmethod
    def _known_number(cls, distortion: list[float]) -> list[float]:
        if len(distortion) not in _DISTORTIONS:
            raise ValueError(f"should have 4, 5, 8, 12 or 14 numbers, not {len(distortion)}")
        return distortion


class ImageSection(Section):
    """From the camera's pixels to the image in which everything is measured.

    Order: crop, flip, rotate, lens, warp, else a resize if the sizes differ.
    """

    width_px: PositiveInt = Field(le=_MOST_PX, description="Width of the resulting image.")
    height_px: PositiveInt = Field(le=_MOST_PX, description="Height of the resulting image.")
    mm_per_px: PositiveFloat = Field(description="Scale of the resulting image on the gel.")
    crop: Crop | None = Field(
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

    @field_validator("height_px")
    @classmethod
    def _fits_memory(cls, height_px: int, info: ValidationInfo) -> int:
        width_px = info.data.get("width_px", 0)
        if width_px * height_px > MOST_PIXELS:
            raise ValueError(
                f"makes an image of {width_px} × {height_px}; at most {MOST_PIXELS / 1e6:.0f} "
                f"megapixels are measured"
            )
        return height_px

    @field_validator("crop")
    @classmethod
    def _lies_in_an_image(cls, crop: Crop | None) -> Crop | None:
        if crop is not None and (max(crop) > _MOST_PX or crop[2] * crop[3] > MOST_PIXELS):
            raise ValueError(
                f"should lie within {_MOST_PX} px and have at most {MOST_PIXELS / 1e6:.0f} "
                f"megapixels"
            )
        return crop

    @field_validator("mm_per_px")
    @classmethod
    def _not_px_per_mm(cls, mm_per_px: float, info: ValidationInfo) -> float:
        if mm_per_px < _FINEST_MM:
            raise ValueError(
                f"should be {_FINEST_MM:g} at least, not {mm_per_px:g}, which no camera resolves"
            )
        width_mm = mm_per_px * info.data.get("width_px", 0)
        if width_mm > _WIDEST_MM:
            raise ValueError(
                f"{mm_per_px:g} mm per pixel makes the image {width_mm / 1000:.3g} m wide; "
                f"if this is pixels per mm, write {1 / mm_per_px:.4g}"
            )
        return mm_per_px

    @property
    def full_scale(self) -> float:
        """The largest intensity."""
        return float(2**self.bit_depth - 1)


class Markers(Section):
    """Marks printed on the membrane."""

    pitch_mm: PositiveFloat = Field(description="Distance of neighbouring marks.")
    diameter_mm: PositiveFloat = Field(description="Size of one mark.")

    @field_validator("diameter_mm")
    @classmethod
    def _marks_lie_apart(cls, diameter_mm: float, info: ValidationInfo) -> float:
        pitch_mm = info.data.get("pitch_mm")
        if pitch_mm is not None and diameter_mm >= pitch_mm:
            raise ValueError(
                f"should be smaller than pitch_mm, not {diameter_mm:g}: marks must not touch"
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
        default=None, description="Printed marks; auto finds pitch and size, null means none."
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


class Component(BaseModel):
    """A part that a plugin provides: ``use: plugin.name`` and that part's own options."""

    model_config = ConfigDict(extra="allow", frozen=True)

    use: Annotated[str, AfterValidator(_component_named)] = Field(
        description="The component's name, plugin.name.", json_schema_extra={"pattern": _USE}
    )

    @model_validator(mode="before")
    @classmethod
    def _is_a_mapping(cls, value: Any) -> Any:
        if isinstance(value, str):
            raise ValueError(f"should be a mapping; write {{use: {value}}}")
        return value

    @property
    def options(self) -> dict[str, Any]:
        """The keys beside ``use``; the component's own ``Options`` check them."""
        return dict(self.model_extra or {})


class Profile(Section):
    """One sensor build."""

    schema_version: Literal[1] = Field(alias="schema", description="Format of this file: 1.")
    name: Annotated[str, AfterValidator(_named)] = Field(
        description="The profile's name.", json_schema_extra={"pattern": _NAME}
    )
    revision: str = Field(default="", description="Which revision of the build.")
    description: str = Field(default="", description="One sentence for people.")
    image: ImageSection = Field(description="The image in which everything is measured.")
    gel: Gel = Field(default_factory=Gel, description="The elastomer and its marks.")
    camera: Component = Field(
        default_factory=lambda: Component(use="core.replay"), description="What takes images."
    )
    illumination: Component = Field(
        default_factory=lambda: Component(use="core.constant"),
        description="The lights, and how one observation is exposed.",
    )
    calibration: Component = Field(
        default_factory=lambda: Component(use="core.automatic"),
        description="The model from intensities to slopes that 'tactile calibrate' fits.",
    )
    estimators: dict[str, Component] = Field(
        default_factory=dict, description="The steps after the calibration, in order."
    )
    optics: Optics = Field(
        default_factory=Optics, description="Light beyond the lamps' places, for the virtual twin."
    )
    sim: dict[str, Any] = Field(
        default_factory=dict, description="Overlay of this profile for its virtual twin."
    )

    @field_validator("gel")
    @classmethod
    def _marks_fit_the_image(cls, gel: Gel, info: ValidationInfo) -> Gel:
        image = info.data.get("image")
        misfit = None if image is None else markers_misfit(gel, image)
        if misfit is not None:
            raise ValueError(misfit)
        return gel

    @property
    def components(self) -> Mapping[str, Component]:
        """Every component by the key that names it: ``camera``, …, ``estimators.height``."""
        steps = {f"estimators.{name}": step for name, step in self.estimators.items()}
        return {
            "camera": self.camera,
            "illumination": self.illumination,
            "calibration": self.calibration,
            **steps,
        }
