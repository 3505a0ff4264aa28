"""All kernels in one namespace; importing this module imports numba."""

from tactile_core.sim.kernels.carrying import at_present, values
from tactile_core.sim.kernels.gripping import limited
from tactile_core.sim.kernels.light import photograph
from tactile_core.sim.kernels.printing import draw
from tactile_core.sim.kernels.transmission import transmit

__all__ = ["at_present", "draw", "limited", "photograph", "transmit", "values"]
