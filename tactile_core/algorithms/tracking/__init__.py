"""Which detection is which mark: identities that survive large motion, gaps and impostors."""

from tactile_core.algorithms.tracking.evenness import shows_contact
from tactile_core.algorithms.tracking.growth import FEWEST_MARKS
from tactile_core.algorithms.tracking.tracker import MarkTracker

__all__ = ["FEWEST_MARKS", "MarkTracker", "shows_contact"]
