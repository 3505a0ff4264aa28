"""Height from slopes by exact solution of a Poisson equation.

Between two neighbouring pixels the surface should rise by the mean of their two slopes times
``mm_per_px``. The height is the least-squares solution of all these equations. Its Poisson equation
takes the divergence and the Laplacian from the same staggered difference, so a surface whose slopes
average to its differences is recovered exactly, at every size.
"""

from tactile_core.algorithms.poisson.integration import integrate
from tactile_core.algorithms.poisson.robust import integrate_robustly

__all__ = ["integrate", "integrate_robustly"]
