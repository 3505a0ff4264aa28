"""In-plane displacement of the gel surface: dense fields and their decomposition."""

from tactile_core.algorithms.displacement.decomposition import (
    Decomposition,
    curl,
    decompose_field,
    divergence,
)
from tactile_core.algorithms.displacement.marked_surface import MarkedSurface

__all__ = ["Decomposition", "MarkedSurface", "curl", "decompose_field", "divergence"]
