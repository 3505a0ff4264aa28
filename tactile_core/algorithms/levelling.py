"""Heights relative to the undeformed gel surface, from heights that slopes were integrated to."""

from __future__ import annotations

from tactile_core.algorithms.arrays.types import Array, Float32
from tactile_core.algorithms.elasticity import THICKNESS_MM
from tactile_core.algorithms.rest_area import height_error
from tactile_core.algorithms.rest_surface import rest_plane


def set_to_rest(
    height_mm: Float32,
    gx: Array,
    gy: Array,
    *,
    mm_per_px: float,
    drift_slope: float = 0.05,
    levelled: bool = True,
    thickness_mm: float = THICKNESS_MM,
) -> None:
    """Set the undeformed surface to 0 in the height that was integrated from these slopes.

    Works in place: subtracts the plane of the undeformed surface, then the smooth error that its
    undeformed part reveals.

    Parameters
    ----------
    height_mm : (H, W) float32
        Height of any level.
    gx, gy : (H, W)
        ∂z/∂x and ∂z/∂y, dimensionless.
    mm_per_px : float
        Scale of the image.
    drift_slope : float
        Largest tilt that counts as drift; see
        :func:`tactile_core.algorithms.rest_surface.rest_plane`.
    levelled : bool
        Whether to subtract the smooth error; see
        :func:`tactile_core.algorithms.rest_area.height_error`.
    thickness_mm : float
        Thickness of the gel.
    """
    plane = rest_plane(height_mm, gx, gy, mm_per_px=mm_per_px, drift_slope=drift_slope)
    plane.removed_from(height_mm, mm_per_px, out=height_mm)
    if levelled:
        height_mm -= height_error(
            height_mm,
            gx,
            gy,
            mm_per_px=mm_per_px,
            tilt=(plane.slope_x, plane.slope_y),
            thickness_mm=thickness_mm,
        )
