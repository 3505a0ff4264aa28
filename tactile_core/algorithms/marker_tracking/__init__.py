"""Multi-marker tracking: identities that survive large motion, missed and spurious detections."""

from tactile_core.algorithms.marker_tracking.neighbourhood import shows_contact
from tactile_core.algorithms.marker_tracking.tracker import MarkerTracker

__all__ = ["MarkerTracker", "shows_contact"]
