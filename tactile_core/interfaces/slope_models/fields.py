"""A fitted function, or the features that it is given, against one reference."""

from __future__ import annotations

from tactile_core.algorithms.colour_table import ColourTable
from tactile_core.algorithms.slope_field import Model, Sampler, SlopeField
from tactile_core.quantities import Reference


def slope_field(
    function: Model,
    table: ColourTable | None,
    reference: Reference,
    blur_px: float,
    *,
    compiled: bool = False,
) -> SlopeField:
    """Prepare a function for whole images."""
    return SlopeField(
        function,
        table,
        reference.pixels,
        reference.marker_mask,
        full_scale=reference.full_scale,
        blur_px=blur_px,
        compiled=compiled,
    )


def sampler_of(reference: Reference, blur_px: float) -> Sampler:
    """Prepare relative change and place of pixels, exactly as a function is given them."""
    return Sampler(
        reference.pixels, reference.marker_mask, full_scale=reference.full_scale, blur_px=blur_px
    )
