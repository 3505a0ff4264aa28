"""The plugin ``example_arm``: a step that needs the pose of a robot arm, and a log as a sink."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Return the estimators by name."""
    return {"workpiece": "tactile_example_arm.workpiece:Workpiece"}


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Return the sinks by name."""
    return {"log": "tactile_example_arm.log:Log"}
