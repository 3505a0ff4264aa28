"""Which detection is which marker: identities that survive large motion, gaps and impostors."""

from tactile_core.algorithms.marker_tracking.evenness import shows_contact
from tactile_core.algorithms.marker_tracking.growth import FEWEST_MARKERS
from tactile_core.algorithms.marker_tracking.tracker import MarkerTracker

__all__ = ["FEWEST_MARKERS", "MarkerTracker", "shows_contact"]
