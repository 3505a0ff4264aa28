"""In-plane displacement of the gel surface: dense fields and their decomposition."""

from tactile_core.algorithms.displacement.decomposition import (
    Decomposition,
    curl,
    decomposed,
    divergence,
)
from tactile_core.algorithms.displacement.marked_surface import MarkedSurface

__all__ = ["Decomposition", "MarkedSurface", "curl", "decomposed", "divergence"]
