"""Profiles of the rigs that the papers describe, by name."""

from pathlib import Path

DIRECTORY = Path(__file__).parent
