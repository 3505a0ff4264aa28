"""Which detection is which mark: identities that survive large motion, gaps and impostors."""

from tactile_core.algorithms.tracking.evenness import shows_contact
from tactile_core.algorithms.tracking.tracker import FEWEST_MARKS, MarkTracker

__all__ = ["FEWEST_MARKS", "MarkTracker", "shows_contact"]
