"""Options shared by calibrators whose models smooth their images."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from tactile_core.interfaces import device


class SlopeOptions(device.Options):
    """Options of every calibrator whose model maps intensities to slopes."""

    blur_px: float = Field(
        default=2.0,
        ge=0,
        le=20,
        description="Gaussian smoothing against the grain of the coating: standard deviation, px.",
    )
    blur_mm: float | None = Field(
        default=None,
        ge=0,
        description="The same in mm on the gel, independent of the camera's scale; replaces "
        "blur_px.",
    )

    @model_validator(mode="after")
    def _one_blur(self) -> Self:
        if {"blur_px", "blur_mm"} <= self.model_fields_set and self.blur_mm is not None:
            raise ValueError("give blur_px or blur_mm, not both")
        return self

    def smoothing_px(self, mm_per_px: float) -> float:
        """Return the standard deviation in px for an image of this scale, at most 20."""
        return self.blur_px if self.blur_mm is None else min(20.0, self.blur_mm / mm_per_px)
