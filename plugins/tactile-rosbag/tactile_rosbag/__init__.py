"""Readings as a ROS 2 bag, for tactile-core; needs no ROS."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_sinks() -> Mapping[str, str]:
    """Return the sink that writes a bag."""
    return {"bag": "tactile_rosbag.bag:Bag"}
