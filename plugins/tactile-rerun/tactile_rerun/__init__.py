"""Readings for the viewer rerun, for tactile-core."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Return the sink that writes for the viewer."""
    return {"log": "tactile_rerun.rerun_log:RerunLog"}
