"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.displacement import (
    elastic_columns,
    fitted,
    moved_to_present,
    share_of_cells,
    total_of_fields,
    traction_of,
)
from tactile_core.algorithms.kernels.imprint import energy_moments, fit_sums, pattern_of
from tactile_core.algorithms.kernels.marker_images import (
    contrast_of_bytes,
    doubled_mask,
    mean_of_channels,
)
from tactile_core.algorithms.kernels.marker_kinds import kinds_of
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
from tactile_core.algorithms.kernels.slopes import normal_xy_of_bytes
from tactile_core.algorithms.kernels.spots import measured_spots

__all__ = [
    "backward_columns",
    "contrast_of_bytes",
    "double_divergence",
    "doubled_mask",
    "elastic_columns",
    "energy_moments",
    "fit_sums",
    "fitted",
    "forward_columns",
    "kinds_of",
    "mean_of_channels",
    "measured_spots",
    "moved_to_present",
    "mutual_nearest",
    "neighbours_plane",
    "normal_xy_of_bytes",
    "pattern_of",
    "rest_plane",
    "share_of_cells",
    "small_step",
    "solve_low",
    "spacing",
    "total_of_fields",
    "traction_of",
]
