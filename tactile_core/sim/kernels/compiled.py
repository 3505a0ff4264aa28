"""All kernels in one namespace; importing this module imports numba."""

from tactile_core.sim.kernels.carrying import at_present, values
from tactile_core.sim.kernels.light import add_light, normals, read_out
from tactile_core.sim.kernels.printing import draw

__all__ = ["add_light", "at_present", "draw", "normals", "read_out", "values"]
