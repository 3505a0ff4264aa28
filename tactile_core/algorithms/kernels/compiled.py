"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.integration import (
    divergence,
    from_dft_order,
    in_dft_order,
    solve_columns,
)
from tactile_core.algorithms.kernels.resting import rest_plane, resting_gain
from tactile_core.algorithms.kernels.slopes import sines_of_bytes, to_slopes

__all__ = [
    "divergence",
    "from_dft_order",
    "in_dft_order",
    "rest_plane",
    "resting_gain",
    "sines_of_bytes",
    "solve_columns",
    "to_slopes",
]
