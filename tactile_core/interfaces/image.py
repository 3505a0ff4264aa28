"""The rectified image in which all quantities are measured, derived from the camera's image."""

from __future__ import annotations

from itertools import combinations
from typing import Literal

from pydantic import (
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    ValidationInfo,
    field_validator,
)

from tactile_core.formats.files import MAX_PIXELS
from tactile_core.interfaces.artefact import Section

ImagePoint = tuple[float, float]
Quad = tuple[ImagePoint, ImagePoint, ImagePoint, ImagePoint]
Point3 = tuple[float, float, float]
ImageCrop = tuple[NonNegativeInt, NonNegativeInt, PositiveInt, PositiveInt]

FEWEST_PX = 2  # a slope needs a neighbour
# Largest image side that OpenCV's remap can address: it uses signed 16-bit coordinates.
_MOST_PX = 32_766
_FINEST_MM = 1e-6  # Smallest accepted mm_per_px: one nanometre, far below the resolution of light
_DISTORTIONS = (4, 5, 8, 12, 14)  # Numbers of distortion coefficients that OpenCV accepts


class Warp(Section):
    """Perspective correction, from four corresponding points."""

    source: Quad = Field(description="Four corners [x, y] in the image before the warp, in px.")
    target: Quad = Field(
        description="The same four corners in the width_px × height_px image, in px."
    )

    @field_validator("source", "target")
    @classmethod
    def _four_corners(cls, quad: Quad) -> Quad:
        xs, ys = zip(*quad, strict=True)
        box = (max(xs) - min(xs)) * (max(ys) - min(ys))
        if min(map(abs, _turns(quad))) <= 1e-3 * box:  # [ratio] three corners on a line
            raise ValueError("three of the four corners lie on one line")
        return quad

    @field_validator("target")
    @classmethod
    def _same_order(cls, target: Quad, info: ValidationInfo) -> Quad:
        turns = zip(_turns(info.data.get("source", target)), _turns(target), strict=True)
        if len({before * after > 0 for before, after in turns}) > 1:
            raise ValueError("lists the corners in a different order than source")
        return target


def _turns(quad: Quad) -> list[float]:
    """Return twice the signed area of each triangle of corners, positive from x towards y."""
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
    """Converts camera pixels to the image in which all quantities are measured.

    Order: crop, flip, rotate, lens, warp; without a warp, a resize if the sizes differ.
    """

    width_px: int = Field(ge=FEWEST_PX, le=_MOST_PX, description="Width of the resulting image.")
    height_px: int = Field(ge=FEWEST_PX, le=_MOST_PX, description="Height of the resulting image.")
    mm_per_px: PositiveFloat = Field(description="Scale of the resulting image on the gel.")
    crop: ImageCrop | None = Field(
        default=None, description="[x, y, width, height] in the camera's pixels."
    )
    flip: Literal["none", "horizontal", "vertical", "both"] = Field(
        default="none", description="Mirrors the image."
    )
    rotate_deg: Literal[0, 90, 180, 270] = Field(
        default=0, description="Clockwise rotation of the image."
    )
    lens: Lens | None = Field(default=None, description="Corrects lens distortion.")
    warp: Warp | None = Field(default=None, description="Perspective correction.")
    color: Literal["rgb", "grey", "luma"] = Field(
        default="rgb",
        description="Whether one exposure has three colours or one intensity: that of a grey "
        "camera, or the luma of a colour camera under white light.",
    )
    transfer: Literal["gamma", "linear"] = Field(
        default="gamma", description="Whether intensities are gamma-coded or linear in radiance."
    )
    bit_depth: Literal[8, 10, 12, 14, 16] = Field(
        default=8, description="Bits per intensity as the camera delivers them."
    )

    @field_validator("height_px")
    @classmethod
    def _fits_memory(cls, height_px: int, info: ValidationInfo) -> int:
        width_px = info.data.get("width_px", 0)
        if width_px * height_px > MAX_PIXELS:
            raise ValueError(
                f"makes an image of {width_px} × {height_px}; the limit is "
                f"{MAX_PIXELS / 1e6:.0f} megapixels"
            )
        return height_px

    @field_validator("crop")
    @classmethod
    def _is_within_an_image(cls, crop: ImageCrop | None) -> ImageCrop | None:
        if crop is not None and (max(crop) > _MOST_PX or crop[2] * crop[3] > MAX_PIXELS):
            raise ValueError(
                f"should be within {_MOST_PX} px and have at most {MAX_PIXELS / 1e6:.0f} megapixels"
            )
        return crop

    @field_validator("mm_per_px")
    @classmethod
    def _not_px_per_mm(cls, mm_per_px: float, info: ValidationInfo) -> float:
        if mm_per_px < _FINEST_MM:
            raise ValueError(
                f"should be at least {_FINEST_MM:g}, not {mm_per_px:g}, which no camera resolves"
            )
        width_mm = mm_per_px * info.data.get("width_px", 0)
        if width_mm > 1000.0:  # [mm] wider: it was given in pixels per mm
            raise ValueError(
                f"{mm_per_px:g} mm per pixel makes the image {width_mm / 1000:.3g} m wide; "
                f"if this is pixels per mm, write {1 / mm_per_px:.4g}"
            )
        return mm_per_px

    @property
    def full_scale(self) -> float:
        """The largest intensity."""
        return float(2**self.bit_depth - 1)
