"""Printed markers: contrast, mask, centroids, the lattice, and identities that are kept."""

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
from tactile_core.algorithms.markers.neighbourhood import shows_contact
from tactile_core.algorithms.markers.tracker import MarkerTracker

__all__ = [
    "Lattice",
    "MarkerTracker",
    "Tone",
    "contrast_of",
    "expected_count",
    "find_detectable_lattice",
    "find_marker_lattice",
    "find_markers",
    "marker_mask",
    "mask_of",
    "reduction",
    "shows_contact",
    "too_few",
]
