"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.gain import lower, resting_gain
from tactile_core.algorithms.kernels.neighbours import (
    mutual_nearest,
    neighbours_plane,
    paired_both_ways,
    room_at,
)
from tactile_core.algorithms.kernels.poisson_columns import (
    backward_columns,
    double_divergence,
    forward_columns,
    solve_low,
)
from tactile_core.algorithms.kernels.rest_plane import rest_plane
from tactile_core.algorithms.kernels.slopes import sines_of_bytes, to_slopes
from tactile_core.algorithms.kernels.spots import halved_brightness, moments_of_labels
from tactile_core.algorithms.kernels.validity import two_of_three_within

__all__ = [
    "backward_columns",
    "double_divergence",
    "forward_columns",
    "halved_brightness",
    "lower",
    "moments_of_labels",
    "mutual_nearest",
    "neighbours_plane",
    "paired_both_ways",
    "rest_plane",
    "resting_gain",
    "room_at",
    "sines_of_bytes",
    "solve_low",
    "to_slopes",
    "two_of_three_within",
]
