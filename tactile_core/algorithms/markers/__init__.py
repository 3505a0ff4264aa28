"""Printed markers in one frame: contrast, mask, centroids, and the geometry of the lattice."""

from tactile_core.algorithms.markers.contrast import contrast_of, marker_mask, mask_of, reduction
from tactile_core.algorithms.markers.count import (
    detectable_diameter,
    expected_count,
    find_marker_diameter,
    too_few,
)
from tactile_core.algorithms.markers.detection import find_markers

__all__ = [
    "contrast_of",
    "detectable_diameter",
    "expected_count",
    "find_marker_diameter",
    "find_markers",
    "marker_mask",
    "mask_of",
    "reduction",
    "too_few",
]
