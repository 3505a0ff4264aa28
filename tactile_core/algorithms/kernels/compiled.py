"""Every kernel, by name; importing this module imports numba."""

from tactile_core.algorithms.kernels.contact import drawn_contact, touched_regions
from tactile_core.algorithms.kernels.displacement import (
    elastic_columns,
    fitted,
    moved_to_present,
    share_of_cells,
    total_of_fields,
    traction_of,
)
from tactile_core.algorithms.kernels.imprint import energy_moments, fit_sums, halved, pattern_of
from tactile_core.algorithms.kernels.light import readable_quotients, undeformed_gain
from tactile_core.algorithms.kernels.marker_images import (
    contrast_of_colours,
    dark_mask,
)
from tactile_core.algorithms.kernels.neighbours import (
    mutual_nearest,
    neighbours_plane,
    small_step,
    spacing,
    steady_step,
)
from tactile_core.algorithms.kernels.poisson_columns import (
    backward_columns,
    double_divergence,
    forward_columns,
    solve_low,
)
from tactile_core.algorithms.kernels.slopes import (
    corrected_slopes,
    extrapolated,
    filled_where_hidden,
    halved_where_bare,
    normal_xy_of_bytes,
)
from tactile_core.algorithms.kernels.spot_pixels import spot_pixels
from tactile_core.algorithms.kernels.spots import measured_spots
from tactile_core.algorithms.kernels.stored import load_alone

__all__ = [
    "backward_columns",
    "contrast_of_colours",
    "corrected_slopes",
    "dark_mask",
    "double_divergence",
    "drawn_contact",
    "elastic_columns",
    "energy_moments",
    "extrapolated",
    "filled_where_hidden",
    "fit_sums",
    "fitted",
    "forward_columns",
    "halved",
    "halved_where_bare",
    "measured_spots",
    "moved_to_present",
    "mutual_nearest",
    "neighbours_plane",
    "normal_xy_of_bytes",
    "pattern_of",
    "readable_quotients",
    "share_of_cells",
    "small_step",
    "solve_low",
    "spacing",
    "spot_pixels",
    "steady_step",
    "total_of_fields",
    "touched_regions",
    "traction_of",
    "undeformed_gain",
]

for _name in __all__:
    load_alone(globals()[_name])
