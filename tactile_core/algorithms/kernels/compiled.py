"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.imprint import energy_moments, fit_sums, pattern_of
from tactile_core.algorithms.kernels.levelling import rest_area, smooth_error
from tactile_core.algorithms.kernels.light import readable_quotients, undeformed_gain
from tactile_core.algorithms.kernels.marker_images import (
    contrast_of_bytes,
    doubled_mask,
    mean_of_channels,
)
from tactile_core.algorithms.kernels.neighbours import (
    mutual_nearest,
    neighbours_plane,
    small_step,
    spacing,
)
from tactile_core.algorithms.kernels.poisson_columns import (
    backward_columns,
    double_divergence,
    forward_columns,
    solve_low,
)
from tactile_core.algorithms.kernels.rest_plane import rest_plane
from tactile_core.algorithms.kernels.slopes import (
    corrected_slopes,
    halved_where_bare,
    normal_xy_of_bytes,
)
from tactile_core.algorithms.kernels.spots import measured_spots

__all__ = [
    "backward_columns",
    "contrast_of_bytes",
    "corrected_slopes",
    "double_divergence",
    "doubled_mask",
    "energy_moments",
    "fit_sums",
    "forward_columns",
    "halved_where_bare",
    "mean_of_channels",
    "measured_spots",
    "mutual_nearest",
    "neighbours_plane",
    "normal_xy_of_bytes",
    "pattern_of",
    "readable_quotients",
    "rest_area",
    "rest_plane",
    "small_step",
    "smooth_error",
    "solve_low",
    "spacing",
    "undeformed_gain",
]
