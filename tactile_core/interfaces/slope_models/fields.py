"""A fitted function and its features, prepared for one reference."""

from __future__ import annotations

from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.algorithms.slope_field import Sampler, SlopeField
from tactile_core.algorithms.slope_grid import Model
from tactile_core.quantities import Reference


def slope_field(
    function: Model,
    table: ColourTable | None,
    reference: Reference,
    blur_px: float,
) -> SlopeField:
    """Prepare a fitted function for whole images."""
    return SlopeField(
        function,
        table,
        reference.pixels,
        reference.marker_mask,
        full_scale=reference.full_scale,
        blur_px=blur_px,
    )


def sampler_of(reference: Reference, blur_px: float) -> Sampler:
    """Prepare the features of single pixels (relative change and position) for one reference."""
    return Sampler(
        reference.pixels, reference.marker_mask, full_scale=reference.full_scale, blur_px=blur_px
    )
