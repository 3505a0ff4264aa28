"""All kernels in one namespace; importing this module imports numba."""

from tactile_core.algorithms.kernels.stored import load_alone
from tactile_core.sim.kernels.carrying import at_present, values
from tactile_core.sim.kernels.gripping import limited
from tactile_core.sim.kernels.light import photograph
from tactile_core.sim.kernels.printing import draw

__all__ = ["at_present", "draw", "limited", "photograph", "values"]

for _name in __all__:
    load_alone(globals()[_name])
