"""Profiles of the sensors in the GelSight papers, by name."""

from pathlib import Path

DIRECTORY = Path(__file__).parent
"""Folder of the profiles."""
