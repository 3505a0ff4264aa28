"""The profile of the GelSlim 4 for tactile-core."""

from __future__ import annotations

from pathlib import Path

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_profiles() -> Path:
    """Return the folder of the profiles."""
    return Path(__file__).parent / "profiles"
