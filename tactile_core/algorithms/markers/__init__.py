"""Printed markers in one frame: contrast, mask, centroids, and the geometry of the lattice."""

from tactile_core.algorithms.markers.contrast import (
    Tone,
    contrast_of,
    marker_mask,
    mask_of,
    reduction,
)
from tactile_core.algorithms.markers.count import (
    Lattice,
    expected_count,
    find_detectable_lattice,
    find_marker_lattice,
    too_few,
)
from tactile_core.algorithms.markers.detection import find_markers

__all__ = [
    "Lattice",
    "Tone",
    "contrast_of",
    "expected_count",
    "find_detectable_lattice",
    "find_marker_lattice",
    "find_markers",
    "marker_mask",
    "mask_of",
    "reduction",
    "too_few",
]
