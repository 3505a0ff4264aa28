"""From slopes to height: the surface whose differences fit the slopes best, exactly.

Between two neighbouring pixels the surface should rise by the mean of their two slopes times
``mm_per_px``. The height is the least-squares solution of all these equations at once: its
Poisson equation has the divergence and the Laplacian of one and the same staggered difference, so
a surface whose slopes average to its differences comes back exactly, at every size.
"""

from tactile_core.algorithms.poisson.integration import PoissonSolver, integrate
from tactile_core.algorithms.poisson.robust import integrate_robustly

__all__ = ["PoissonSolver", "integrate", "integrate_robustly"]
