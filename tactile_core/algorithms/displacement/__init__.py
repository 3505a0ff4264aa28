"""How the skin is dragged: from marks to every pixel, and what a field is made of."""

from tactile_core.algorithms.displacement.decomposition import Decomposition, decomposed
from tactile_core.algorithms.displacement.derivatives import curl, divergence
from tactile_core.algorithms.displacement.marked_skin import MarkedSkin

__all__ = ["Decomposition", "MarkedSkin", "curl", "decomposed", "divergence"]
