"""``python -m tactile_core.cli``."""

from tactile_core.cli import program

program()
