"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.imprint import energy_moments, fit_sums, pattern_of
from tactile_core.algorithms.kernels.neighbours import (
    mutual_nearest,
    neighbours_plane,
)
from tactile_core.algorithms.kernels.poisson_columns import (
    backward_columns,
    double_divergence,
    forward_columns,
    solve_low,
)
from tactile_core.algorithms.kernels.rest_plane import rest_plane
from tactile_core.algorithms.kernels.slopes import normal_xy_of_bytes, to_slopes
from tactile_core.algorithms.kernels.spots import moments_of_labels

__all__ = [
    "backward_columns",
    "double_divergence",
    "energy_moments",
    "fit_sums",
    "forward_columns",
    "moments_of_labels",
    "mutual_nearest",
    "neighbours_plane",
    "normal_xy_of_bytes",
    "pattern_of",
    "rest_plane",
    "solve_low",
    "to_slopes",
]
