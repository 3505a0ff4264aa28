"""Readings as live topics of ROS 2, for tactile-core; needs no ROS."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_commands() -> Mapping[str, str]:
    """Return the command that publishes a sensor."""
    return {"ros2": "tactile_ros2.command:ros2"}
