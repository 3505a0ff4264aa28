"""Options of calibrators whose models smooth the images that they measure."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from tactile_core.interfaces import device


class SlopeOptions(device.Options):
    """Options of every calibrator whose model reads slopes from light."""

    blur_px: float = Field(
        default=2.0,
        ge=0,
        le=20,
        description="Smoothing against the grain of the coating, standard deviation.",
    )
    blur_mm: float | None = Field(
        default=None, ge=0, description="The same on the gel, for cameras of other scales."
    )

    @model_validator(mode="after")
    def _one_blur(self) -> Self:
        if {"blur_px", "blur_mm"} <= self.model_fields_set and self.blur_mm is not None:
            raise ValueError("give blur_px or blur_mm, not both")
        return self

    def smoothing_px(self, mm_per_px: float) -> float:
        """Standard deviation in px of an image of this scale, 20 at the most."""
        return self.blur_px if self.blur_mm is None else min(20.0, self.blur_mm / mm_per_px)
