"""The plugin ``example_arm``: a step that needs the arm's pose, and a sink for a robot's log."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    """Where each estimator lives."""
    return {"workpiece": "tactile_example_arm.workpiece:Workpiece"}


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Where each sink lives."""
    return {"log": "tactile_example_arm.log:Log"}
