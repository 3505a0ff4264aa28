"""The live page: sensors in a browser, with buttons for the work of a day."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the command that serves the page."""
    return {"view": "tactile_live.view:view"}
